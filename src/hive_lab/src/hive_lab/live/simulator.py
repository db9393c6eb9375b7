# SPDX-License-Identifier: BSD-3-Clause
"""Measures how fast simulated time can pass: in this process, and through ROS.

Through ROS twice: the simulator's node alone, and a whole hive with all nodes of four robots.
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
from hive_lab.bench import system
from hive_lab.bench.registry import BenchResult, run_apart
from hive_lab.bench.simulator import AIMS, measure_in_process
from hive_lab.live import simulator_driver

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client.client import ClientLink

_RTF = 6.0
"""Real-time factor asked of the whole hive: a little above the aim. A simulator that is asked for
much more takes processor time away from the robots that it simulates.
"""

_MAX_RTF = 100.0  # real-time factor asked of the simulator alone: more than it reaches
_AIM = 0.2  # wall time for a simulated second with all nodes of four robots, at most [s]
_LIMIT = 300.0  # time limit for the simulator alone [s]


def run(connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]]) -> BenchResult:
    """Measure all; `connect` opens the link, see `cli.context.CliContext`.

    Returns:
        The figures of `measure_in_process`; `speed_node_...` and `cpu_node_...`, simulated seconds
        of the simulator's node alone in one on the wall clock and of its processor time; `ros_4`,
        wall time for a simulated second of a whole hive that drives [s], `speed_ros_4`, its
        inverse, what `bench.system` says of the drives, and `ros_4 cpu ...` of each process
        [s per s]. It is broken if anything touched in the hive.
    """
    click.echo("in this process, for half a minute", err=True)
    figures, aims = measure_in_process(), AIMS | {"ros_4": _AIM, "ros_4 contacts": 0.0}
    click.echo("the simulator alone, for a minute", err=True)
    figures |= _simulator_alone()
    hive = run_apart(system.measure, connect, _RTF)
    figures["speed_ros_4"] = hive["real_time_factor"]
    figures["ros_4"] = 1.0 / hive["real_time_factor"]
    for name in ("driving_share", "contacts", "unanswered"):
        figures[f"ros_4 {name}"] = hive[name]
    figures |= {f"ros_4 {name}": value for name, value in hive.items() if name.startswith("cpu")}
    return BenchResult(figures, aims, broken=hive["contacts"] > 0)


def _simulator_alone() -> dict[str, float]:
    """Return the figures of `simulator_driver`, on a ROS master of its own."""
    with (
        tempfile.TemporaryDirectory(prefix="robo-hive-bench-") as folder,
        local_hive(Path(folder)) as hive,
    ):
        hive.start_master()
        words = ["simenv", "simulator.launch", "world:=warehouse", f"rtf:={_MAX_RTF:g}"]
        hive.processes.start("simulator", ["roslaunch", *words])
        done = subprocess.run(  # noqa: S603  (our own program)
            [sys.executable, "-m", simulator_driver.__name__],
            stdout=subprocess.PIPE,
            text=True,
            check=False,
            timeout=_LIMIT,
        )
        hive.check()
    if done.returncode:
        raise StartError("the simulator could not be measured; see the reason above")
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return figures
