# SPDX-License-Identifier: BSD-3-Clause
"""Measures how fast simulated time can pass: in this process, and through ROS.

Through ROS twice: the simulator's node alone, with nobody but whoever drives the robots, and a
whole hive with all nodes of four robots.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fleet_manager.demo.local_hive import local_hive
from fleet_manager.errors import StartError
from hive_lab.bench import sim, system
from hive_lab.bench.registry import BenchResult

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client.client import Link

_RTF = 6.0
"""What the whole hive is asked for: a little more than the aim. A simulator that is asked for much
more takes processor time away from the robots that it simulates."""

_MAX_RTF = 100.0
"""What the simulator alone is asked for: more than it reaches."""

_AIM = 0.2
"""Wall time for a simulated second with all nodes of four robots, at most [s]."""

_LIMIT = 300.0
"""The simulator alone is measured by then [s]."""


def measure(connect: Callable[[Sequence[str]], AbstractContextManager[Link]]) -> BenchResult:
    """Measure all.

    Args:
        connect: Opens the link; see `cli.outside.Outside`.

    Returns:
        The figures of `hive_lab.bench.sim.run`; `speed_node_...`, simulated seconds in one on the
        wall of the simulator's node alone, and `cpu_node_...`, in one of its processor time;
        `ros_4`, wall time for a simulated second with all nodes of four robots that drive [s],
        `speed_ros_4`, the other way round, what `bench.system` says of how they drove, and
        `ros_4 cpu ...` of each process meanwhile [s per s].
    """
    click.echo("in this process, for half a minute", err=True)
    found = sim.run()
    figures, aims = found["figures"], found["aims"] | {"ros_4": _AIM}
    click.echo("the simulator alone, for a minute", err=True)
    figures |= _simulator_alone()
    hive = system.measure(connect, rtf=_RTF).figures
    figures["speed_ros_4"] = hive["real_time_factor"]
    figures["ros_4"] = 1.0 / hive["real_time_factor"]
    for name in ("driving_share", "collisions", "unanswered"):
        figures[f"ros_4 {name}"] = hive[name]
    figures |= {f"ros_4 {name}": value for name, value in hive.items() if name.startswith("cpu")}
    return BenchResult(figures, aims)


def _simulator_alone() -> dict[str, float]:
    """Return what `ros.bench_simulator` finds, on a ROS master of its own."""
    with (
        tempfile.TemporaryDirectory(prefix="robo-hive-bench-") as folder,
        local_hive(Path(folder)) as hive,
    ):
        hive.start_master()
        words = ["simenv", "simulator.launch", "world:=warehouse", f"rtf:={_MAX_RTF:g}"]
        hive.processes.start("simulator", ["roslaunch", *words])
        done = subprocess.run(
            [sys.executable, "-m", "hive_lab.live.simulator_driver"],
            stdout=subprocess.PIPE,
            text=True,
            check=False,
            timeout=_LIMIT,
        )
        hive.check()
    if done.returncode:
        raise StartError("the simulator could not be measured; the reason stands above")
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return figures
