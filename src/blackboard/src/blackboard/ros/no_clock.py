# SPDX-License-Identifier: BSD-3-Clause
"""Says that simulated time is asked for, and that nobody gives it.

A ROS master keeps `/use_sim_time` when a simulation ends. Nodes that are started for real robots
then wait for a time that never comes: robots take tasks, begin them, and never get on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.domain.talker import Talker

TIMEOUT = 10.0
"""Longer than a simulator takes to start [s]."""

REPEAT = 30.0
"""Time between two warnings [s]."""


class NoClock:
    """Warns while a member has no time.

    Attributes:
        text: What is missing; empty while nothing is.
    """

    def __init__(self, talker: Talker) -> None:
        self._talker = talker
        self._since = talker.now()
        self._warned = float("-inf")
        self.text = ""

    def look(self) -> None:
        """Find out whether time has come, and warn now and then."""
        now = self._talker.now()
        if self._talker.date() > 0.0 or now - self._since < TIMEOUT:
            self.text = ""
            return
        self.text = (
            "no time comes on /clock, although the parameter /use_sim_time is true, so no task "
            "gets on. For real robots, run `rosparam set /use_sim_time false` and start all nodes "
            "again; for simulated ones, start the simulator"
        )
        if now - self._warned >= REPEAT:
            self._warned = now
            self._talker.warn(self.text)
