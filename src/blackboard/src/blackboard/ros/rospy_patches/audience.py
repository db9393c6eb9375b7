# SPDX-License-Identifier: BSD-3-Clause
"""Sends a message only to the subscribers that it concerns.

`Audience` replaces "publish to everyone". Every voter is connected to all other members on every
topic, so that any of them can lead at once and without the ROS master. Most messages concern the
leader alone, and reading a message costs a member ten times as much as sending it costs. With ten
robots, leaving members out cut the median time from posting a task to its assignment from 79 to
31 ms (docs/decisions/070).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    import rospy

_NAMELESS = "unknown"
"""rospy's name for a publisher that has not said its own yet."""


class Audience:
    """Knows which subscribers are members, and leaves out those that a message does not concern.

    To a voter, members are the nodes that publish on `bb_ack` and subscribe to `bb_entries`. To a
    learner, which talks to voters only, they are those that publish on `bb_entries` and subscribe
    to `bb_ack`. A subscriber that is not known as a member yet gets everything.

    Args:
        node_of: Returns the name of the node that speaks for a robot or a member; empty if
            unknown.

    Attributes:
        speaks: The publisher to members; None if there is none.
        listens: The subscriber to members; None if there is none.
    """

    def __init__(self, node_of: Callable[[str], str]) -> None:
        self._node_of = node_of
        self.speaks: rospy.Publisher | None = None
        self.listens: rospy.Subscriber | None = None
        self._links: tuple[Sequence[Any], Sequence[Any]] = ((), ())
        self._members: frozenset[str] = frozenset()

    def tell(self, publisher: rospy.Publisher, message: object, to: Collection[str]) -> None:
        """Publish to some members, and to everyone who is not a member.

        `to` holds names of members, which begin with a slash, or of robots.
        """
        nodes = {self._node(name) for name in to if name}
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

    def _node(self, name: str) -> str:
        """Return the node of a member or a robot; a member that shares no process is a node."""
        return self._node_of(name) or (name if name.startswith("/") else "")

    def _known_members(self) -> frozenset[str]:
        """Return the names of the members; computed again only if rospy's connections changed."""
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
    """Some of a publisher's connections, given to rospy as its one `connection_override`."""

    endpoint_id = "several"

    def __init__(self, connections: Sequence[Any]) -> None:
        self._connections = connections

    def write_data(self, data: bytes) -> None:
        """Send to all; close a connection that is broken, as rospy does."""
        for each in self._connections:
            try:
                each.write_data(data)
            except Exception:  # noqa: BLE001  (whatever it is, rospy then drops the connection)
                each.close()
