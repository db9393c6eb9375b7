# SPDX-License-Identifier: BSD-3-Clause
"""Hands what one node publishes to those of its subscribers that it concerns.

Every member that stands by is connected to all others on every topic, so that any of them can
carry the blackboard at once and without the ROS master. Most of what is said concerns the active
one only, and to read a message costs a member ten times what it costs to send it. So it is the
publisher that leaves out the members that need not hear (docs/decisions/070-who-hears-what.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    import rospy


_NAMELESS = "unknown"
"""How rospy calls a publisher that has not said its name yet."""


class Audience:
    """Knows which subscribers are members: those that speak on `bb_ack` and hear `bb_entries`.

    A robot that does not stand by speaks to those only who do, and knows them the other way round:
    they speak on `bb_entries` and hear `bb_ack`. A subscriber of which it is not known yet whether
    it is a member hears everything.

    Args:
        node_of: Gives the name of the node that speaks as a robot; empty where nobody is known to.

    Attributes:
        speaks: The publisher to members; None in a node that is none.
        listens: The subscriber that hears members; None in a node that is none.
    """

    def __init__(self, node_of: Callable[[str], str]) -> None:
        self._node_of = node_of
        self.speaks: rospy.Publisher | None = None
        self.listens: rospy.Subscriber | None = None
        self._links: tuple[Sequence[Any], Sequence[Any]] = ((), ())
        self._members: frozenset[str] = frozenset()

    def tell(self, publisher: rospy.Publisher, message: object, to: Collection[str]) -> None:
        """Publish to some members only, and to everyone who is no member.

        Args:
            publisher: On which topic.
            message: Of the topic's type.
            to: Names of nodes, which begin with a slash, or of robots.
        """
        nodes = {name if name.startswith("/") else self._node_of(name) for name in to if name}
        impl = publisher.impl
        if "" in nodes or impl is None:
            publisher.publish(message)
            return
        left_out = self._known_members() - nodes
        chosen = [each for each in impl.connections if each.endpoint_id not in left_out]
        impl.acquire()
        try:
            impl.publish(message, connection_override=_Several(chosen))
        finally:
            impl.release()

    def _known_members(self) -> frozenset[str]:
        """Return the names of the members; found anew only when rospy has changed its links."""
        if self.speaks is None or self.listens is None:
            return frozenset()
        there, here = self.speaks.impl.connections, self.listens.impl.connections
        if self._links[0] is not there or self._links[1] is not here:
            speak = frozenset(each.callerid_pub for each in here)
            self._members = speak & {each.endpoint_id for each in there}
            if _NAMELESS not in speak:
                self._links = there, here
        return self._members


class _Several:
    """Some of a publisher's connections, in the place of one (rospy's `connection_override`)."""

    endpoint_id = "several"

    def __init__(self, connections: Sequence[Any]) -> None:
        self._connections = connections

    def write_data(self, data: bytes) -> None:
        """Send to all of them; one that is broken is closed, as rospy does."""
        for each in self._connections:
            try:
                each.write_data(data)
            except Exception:  # noqa: BLE001  (whatever it is: rospy takes the connection out then)
                each.close()
