# SPDX-License-Identifier: BSD-3-Clause
"""The links of a process that has several robots.

Over Zenoh a robot speaks with its own certificate, on keys that end in its own name. So each robot
of a process has a session and a link of its own. What is said to all is heard once, by the first
one's; the others hear only what is said to their own robot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from blackboard.process.link import Inbox
    from blackboard.zenoh.link import ZenohLink


class ZenohLinks:
    """Carries the messages of several robots; see `process.link.Link`.

    Args:
        links: By robot, each made with all these robots as its `among`, in this order.

    Attributes:
        names: The robots.
    """

    def __init__(self, links: Mapping[str, ZenohLink]) -> None:
        self.names = tuple(links)
        self._links = dict(links)
        self._first = links[self.names[0]]

    def attach(self, inbox: Inbox) -> None:
        """Deliver from now on to this talker."""
        for link in self._links.values():
            link.attach(inbox)

    def publish(self, robot: str, topic: str, value: object, to: Collection[str] | None) -> None:
        """Send a value in the name of a robot."""
        self._links[robot].publish(robot, topic, value, to)

    def listen(self, topic: str, name: str) -> None:
        """Deliver what others say on a topic, by its name below the hive."""
        for link in self._links.values():
            link.listen(topic, name)

    def why_refused(self, value: object, sender: str) -> str:
        """Return why a process may not say this; empty if it may."""
        return self._first.why_refused(value, sender)

    def watch(self, watcher: str, node: str, died: Callable[[], None]) -> None:
        """Call once when a process is proved dead; see `presence`."""
        self._first.watch(watcher, node, died)
