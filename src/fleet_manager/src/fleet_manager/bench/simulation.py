# SPDX-License-Identifier: BSD-3-Clause
"""Measures how fast simulated time can pass: in this process, and with all nodes of a hive."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fleet_manager.bench import system
from fleet_manager.bench.registry import BenchResult
from simenv import bench_sim

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client import Link

_RTF = 20.0
"""Asked for through ROS: more than a machine of today reaches with four robots."""

_AIM = 0.2
"""Wall time for a simulated second with all nodes of four robots, at most [s]."""


def measure(connect: Callable[[Sequence[str]], AbstractContextManager[Link]]) -> BenchResult:
    """Measure both.

    Args:
        connect: Opens the link; see `cli.outside.Outside`.

    Returns:
        The figures of `simenv.bench_sim.run`; `ros_4`, wall time for a simulated second with all
        nodes of four robots that drive [s], `speed_ros_4`, the other way round, and
        `ros_4 cpu ...` of each process meanwhile [s per s].
    """
    found = bench_sim.run()
    figures, aims = found["figures"], found["aims"] | {"ros_4": _AIM}
    hive = system.measure(connect, rtf=_RTF).figures
    figures["speed_ros_4"] = hive["real_time_factor"]
    figures["ros_4"] = 1.0 / hive["real_time_factor"]
    figures |= {f"ros_4 {name}": value for name, value in hive.items() if name.startswith("cpu")}
    return BenchResult(figures, aims)
