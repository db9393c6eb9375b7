# SPDX-License-Identifier: BSD-3-Clause
"""Proves that a node's process has ended: its connection is gone and its port refuses new ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from blackboard.process.death import Answer, PortProbe

if TYPE_CHECKING:
    from collections.abc import Callable

    import rospy

    from blackboard.process.death import Probe

PERIOD = 0.03
"""Time between two checks of the connection [s]; rospy closes it about 25 ms after `kill -9`."""


class LivenessWatch:
    """Watches a subscriber's connection to one node, on a topic that every voter publishes on.

    The connection tells the node's port while it lasts, so this needs no ROS master.
    """

    def __init__(
        self,
        subscriber: rospy.Subscriber,
        probe: Callable[[str, int], Probe] = PortProbe,
    ) -> None:
        """Watch by a subscriber's connection; `probe` returns what asks a port of a host."""
        self._subscriber = subscriber
        self._make_probe = probe
        self._member = ""
        self._died: Callable[[], None] | None = None
        self._uri = ""
        self._probe: Probe | None = None

    def watch(self, member: str, died: Callable[[], None]) -> None:
        """Watch the node of that name instead of the previous one."""
        self._stop()
        self._member, self._died, self._uri = member, died, ""

    def check(self) -> None:
        """Call `died` once the node is proved dead."""
        if self._died is None:
            return
        uri = self._connected_to()
        if uri:
            self._stop()
            self._uri = uri
        elif self._uri and self._refuses():
            self._stop()
            died, self._died = self._died, None
            died()

    def _connected_to(self) -> str:
        """Return the node's address while there is a connection to it; else empty."""
        connections: tuple[Any, ...] = tuple(self._subscriber.impl.connections)
        for each in connections:
            if each.callerid_pub == self._member and each.socket is not None and not each.done:
                return str(each.endpoint_id)
        return ""

    def _refuses(self) -> bool:
        if self._probe is None:
            address = urlsplit(self._uri)
            self._probe = self._make_probe(address.hostname or "", address.port or 0)
        return self._probe.look() is Answer.REFUSES

    def _stop(self) -> None:
        if self._probe is not None:
            self._probe.close()
            self._probe = None
