# SPDX-License-Identifier: BSD-3-Clause
"""Gives a new subscriber of `robot_status` the last status of each robot of a process."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy

from blackboard.codec.tables import WIRES
from blackboard.domain.talker import ROBOT_STATUS

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable, Iterable

    from blackboard.domain.characteristics import RobotStatus


class Recap(rospy.SubscribeListener):  # type: ignore[misc]  # rospy is not typed
    """A listener of the publisher; a latched topic gives the last message only.

    Args:
        robots: Those that the process speaks for; see also `meet`.
    """

    def __init__(self, robots: Iterable[str] = ()) -> None:
        self._lock: threading.Lock | None = None  # rospy's own, which it does not take here
        self._robots = list(robots)
        self._last: dict[str, RobotStatus] = {}
        self._publisher: rospy.Publisher | None = None

    def headers(self) -> dict[str, str]:
        """Return what the headers of connections say: for which robots the process speaks."""
        return {"robots": " ".join(self._robots)}

    def attach(self, publisher: rospy.Publisher) -> None:
        """Use the publisher whose listener this is."""
        self._publisher, self._lock = publisher, publisher.impl.publock

    def meet(self, robot: str) -> None:
        """Speak for one more robot from now on."""
        if robot not in self._robots:
            self._robots.append(robot)
            if self._publisher is not None:
                self._publisher.impl.add_headers(self.headers())

    def note(self, status: RobotStatus) -> None:
        """Note what is published."""
        if status.robot_id in self._robots:
            self._last[status.robot_id] = status

    def peer_subscribe(
        self, _name: str, _publish: Callable[[object], None], tell: Callable[[object], None]
    ) -> None:
        """Tell a new subscriber; rospy calls this."""
        if self._lock is None:
            return
        with self._lock:
            for status in tuple(self._last.values()):
                tell(WIRES[ROBOT_STATUS].to_msg(status, rospy.get_time()))
