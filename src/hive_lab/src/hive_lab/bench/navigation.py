# SPDX-License-Identifier: BSD-3-Clause
"""What a tick of navigation costs, and how fast time passes, with many robots in one hall.

The simulator with lasers, the planner, the follower and the right of way run in this process.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from hive_lab.bench.registry import BenchResult
from hive_lab.fleets.crowd import Crowd

if TYPE_CHECKING:
    from hive_common.pose import Pose
    from hive_navigation.control.navigator import Navigator, Tick
    from hive_navigation.traffic.neighbourhood import Neighbourhood
    from robot_description.scan import Scan

SETTLE = 5.0  # simulated time until all drive [s]
DURATION = {50: 20.0, 200: 8.0}  # simulated time that is measured, by the number of robots [s]

AIMS = {"tick_50": 0.3, "wall_50": 0.25, "wall_200": 1.0}
"""Processor time of a tick [ms]; wall time for a simulated second [s], 4 times real time and 1."""


def run() -> BenchResult:
    """Measure on a machine with nothing else to do.

    Returns:
        For 50 and 200 robots: `wall_N` and `cpu_N`, wall and processor time for a simulated
        second [s]; `tick_N`, processor time of a control tick [ms]; `contacts_N`, robot to robot
        and robot to wall.
    """
    figures: dict[str, float] = {}
    for robots, duration in DURATION.items():
        crowd = Crowd(robots)
        crowd.run(SETTLE)
        watch = _Watch()
        for navigator in crowd.traffic.navigators.values():
            watch.watch(navigator)
        wall, cpu = time.perf_counter(), time.process_time()
        crowd.run(duration)
        figures[f"wall_{robots}"] = (time.perf_counter() - wall) / duration
        figures[f"cpu_{robots}"] = (time.process_time() - cpu) / duration
        figures[f"tick_{robots}"] = 1000.0 * watch.spent / watch.ticks
        figures[f"contacts_{robots}"] = float(crowd.simulation.collisions)
    return BenchResult(figures, AIMS)


class _Watch:
    """Measures the processor time of navigators' ticks."""

    def __init__(self) -> None:
        self.ticks = 0
        self.spent = 0.0  # [s]

    def watch(self, navigator: Navigator) -> None:
        """Measure the ticks of a navigator."""
        tick = navigator.tick

        def timed(now: float, pose: Pose, scan: Scan, heard: Neighbourhood) -> Tick:
            began = time.process_time()
            done = tick(now, pose, scan, heard)
            self.spent += time.process_time() - began
            self.ticks += 1
            return done

        navigator.tick = timed  # type: ignore[method-assign]  # the object's own, for this run
