# SPDX-License-Identifier: BSD-3-Clause
"""Hands what one node publishes to those of its subscribers that it concerns.

Every member that stands by is connected to all others on every topic, so that any of them can
carry the blackboard at once and without the ROS master. Most of what is said concerns the active
one only, and to read a message costs a member ten times what it costs to send it. So it is the
publisher that leaves out the members that need not hear (docs/decisions/070-who-hears-what.md).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.talker import BB_ACK, BB_ENTRIES

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    import rospy


_NAMELESS = "unknown"
"""How rospy calls a publisher that has not said its name yet."""


class Audience:
    """Knows which subscribers are members: those that both speak and listen on `TOPICS`.

    A subscriber of which that is not known yet hears everything.

    Args:
        node_of: Gives the name of the node that speaks as a robot; empty where nobody is known to.

    Attributes:
        speaks: The publishers on `TOPICS` that this node has; none where it is no member.
        listens: The subscribers of `TOPICS` that it has.
    """

    TOPICS = frozenset({BB_ENTRIES, BB_ACK})
    """Of these a member that stands by speaks and listens on both; another one speaks on `bb_ack`
    only and listens to `bb_entries` only."""

    def __init__(self, node_of: Callable[[str], str]) -> None:
        self._node_of = node_of
        self.speaks: list[rospy.Publisher] = []
        self.listens: list[rospy.Subscriber] = []
        self._links: list[Sequence[Any]] = []
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
        there = [publisher.impl.connections for publisher in self.speaks]
        here = [subscriber.impl.connections for subscriber in self.listens]
        links = [*there, *here]
        if list(map(id, links)) != list(map(id, self._links)):
            speak = frozenset(each.callerid_pub for links in here for each in links)
            self._members = speak & {each.endpoint_id for links in there for each in links}
            if _NAMELESS not in speak:
                self._links = links
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
