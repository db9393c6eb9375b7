# SPDX-License-Identifier: BSD-3-Clause
"""Measures the processor time and memory of a hive whose robots all drive.

Four robots drive in the lab, more in a hall of 42 m x 25 m. They get tours through its stations,
always more tours than robots, so that all of them keep driving. All processes of the hive count,
with roslaunch and the ROS master, but not the process that posts the tours.
"""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fleet_manager.client.client import HiveClient
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.demo.history import History
from fleet_manager.demo.local_hive import local_hive, wait_for_everyone
from hive_lab.bench.registry import BenchResult, run_apart
from hive_lab.bench.tours import Tours
from hive_lab.bench.usage import shares, usage_of
from hive_lab.fleets.hall_files import HallFiles, write_hall

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client.client import ClientLink
    from fleet_manager.client.reports import Report
    from fleet_manager.client.words import Event
    from fleet_manager.demo.local_hive import LocalHive

_WORLD = "lab"
_SECONDS = 60.0  # measured time [s, wall clock]; well above the length of a tour's legs
_UNDER_WAY = 10.0  # time from the first tour to the measurement [s]: by then all robots drive
_SLOWEST = 1.05  # a run counts as in time if it takes so many times as long [1]
_MOVING = 0.05  # a robot that covers less than this in a second stands still [m]
AIMS: Mapping[int, Mapping[str, float]] = {
    4: {"cpu": 0.4, "memory": 1.5},
    20: {"cpu": 1.6, "memory": 1.5},
}
"""Cores and memory [GB] at real time, by the number of robots."""
_FASTER = {4: 5.0, 10: 2.0}
"""How many times as fast as real time so many robots should be able to drive."""


class _Recorder:
    """Adds every report to a history, by the hive's clock."""

    def __init__(self, link: ClientLink) -> None:
        self.history = History(link.hive_time())
        self._link = link

    def __call__(self, report: Report | None, _events: Sequence[Event]) -> None:
        if report is not None:
            self.history.add(self._link.hive_time(), report)

    def distances(self) -> dict[str, float]:
        """Return the distance that each robot has driven [m]."""
        return {name: track.distance for name, track in self.history.tracks.items()}


def run(
    connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]], robots: int = 4
) -> BenchResult:
    """Let robots drive for a minute in real time, then, for some numbers, as fast as they should.

    Returns:
        `cpu` [s per s] and `memory` [GB] in sum and of each process; `seconds` measured;
        `driving_share`, the part of the robots' time in which they moved; `real_time_factor`;
        `slowness`, the factor asked for over that reached; `contacts`; `unanswered`, tours posted
        in vain. Those of the faster run begin with `fast`. Aims: `AIMS`, no contact, and a
        slowness of at most 1.05. It is broken if anything touched.
    """
    figures = run_apart(measure, connect, 1.0, robots)
    aims = {**AIMS.get(robots, {}), "contacts": 0.0, "slowness": _SLOWEST}
    if robots in _FASTER:
        fast = run_apart(measure, connect, _FASTER[robots], robots)
        figures |= {f"fast {name}": value for name, value in fast.items()}
        aims |= {"fast contacts": 0.0, "fast slowness": _SLOWEST}
    touched = figures["contacts"] + figures.get("fast contacts", 0.0)
    return BenchResult(figures, aims, broken=touched > 0)


def measure(
    connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]],
    rtf: float = 1.0,
    robots: int = 4,
) -> dict[str, float]:
    """Return the figures of one run; see `run`.

    Args:
        connect: Opens the link; see `cli.context.CliContext`.
        rtf: Real-time factor asked of the simulator.
        robots: Their number.
    """
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        at_home = robots == len(read_fleet(_WORLD).robots)
        files = HallFiles(_WORLD, _WORLD, _WORLD) if at_home else write_hall(folder, robots)
        names = [robot.name for robot in read_fleet(files.fleet).robots]
        arguments = {**files._asdict(), "rviz": "false", "gui": "false", "rtf": f"{rtf:g}"}
        hive = stack.enter_context(local_hive(folder))
        click.echo(f"starting {robots} robots, then measuring for {_SECONDS:g} s", err=True)
        hive.start_master()
        hive.launch(arguments)
        link = stack.enter_context(connect(names))
        recorder = _Recorder(link)
        client = HiveClient(link, recorder)
        wait_for_everyone(client, names, hive)
        tours = Tours(client, robots, files.world)
        figures = _measure(client, tours, recorder, hive, robots)
    return {**figures, "slowness": round(rtf / figures["real_time_factor"], 4)}


def _measure(
    client: HiveClient, tours: Tours, recorder: _Recorder, hive: LocalHive, robots: int
) -> dict[str, float]:
    """Let the robots drive, and compare what was taken before and after."""
    _drive(client, tours, recorder, hive, _UNDER_WAY)
    wall, time = client.link.now(), client.link.hive_time()
    before = usage_of(hive.processes.members())
    moving = _drive(client, tours, recorder, hive, _SECONDS)
    after = usage_of(hive.processes.members())
    seconds = client.link.now() - wall
    parts = shares(before, after, seconds)
    figures = {
        "cpu": sum(cpu for cpu, _ in parts.values()),
        "memory": sum(memory for _, memory in parts.values()) / 1e9,
        "seconds": seconds,
        "driving_share": moving / robots,
        "real_time_factor": (client.link.hive_time() - time) / seconds,
        "contacts": float(recorder.history.collisions),
        "unanswered": float(tours.unanswered),
    }
    for name, (cpu, memory) in parts.items():
        figures[f"cpu {name}"] = cpu
        figures[f"memory {name}"] = memory / 1e9
    return {name: round(value, 4) for name, value in figures.items()}


def _drive(
    client: HiveClient, tours: Tours, recorder: _Recorder, hive: LocalHive, seconds: float
) -> float:
    """Keep the robots driving for a time [s]; return the mean number that moved."""
    end = client.link.now() + seconds
    looks = moving = 0
    while client.link.now() < end:
        tours.refill()
        before = recorder.distances()
        client.pump(lambda: False, 1.0)
        hive.check()
        after = recorder.distances()
        looks += 1
        moving += sum(after[name] - before.get(name, 0.0) > _MOVING for name in after)
    return moving / max(looks, 1)
