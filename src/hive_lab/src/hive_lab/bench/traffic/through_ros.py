# SPDX-License-Identifier: BSD-3-Clause
"""Measures what a traffic planner is worth to a whole hive on ROS.

Ten robots of all models do tours through the stations of the hall, once with the traffic planner
and once by the right of way alone; the auction, the windows' topics and the simulator are real.
"""

from __future__ import annotations

import contextlib
import math
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from blackboard.consensus.messages import Heartbeat
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.client import HiveClient
from fleet_manager.client.reports import Collisions, TruePlace
from fleet_manager.client.traffic import TrafficState
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.demo.local_hive import local_hive, wait_for_everyone
from hive_lab.bench.registry import BenchResult, run_apart
from hive_lab.bench.tours import Tours
from hive_lab.fleets.hall_files import write_hall

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client.client import ClientLink
    from fleet_manager.client.reports import Report
    from fleet_manager.client.words import Event

    Connect = Callable[[Sequence[str]], AbstractContextManager[ClientLink]]

ROBOTS = 10
RTF = 2.0  # real-time factor that is asked for; simulated time waits for a busy machine
START_WITHIN = 300.0  # [s, wall clock]
HOUR = 3600.0  # [s]
MOVED = 0.05  # a robot that has come no farther stands [m]


class Account:
    """Keeps account of a run, from what the hive and the simulator report.

    Attributes:
        legs: How many goals were reached.
        failed: How many tours have failed.
        contacts: How often robots have touched something.
        locks: How many locks the traffic planner has found.
        longest_stand: For how long a robot with a task has stood still [s].
        heartbeat_gap: The longest time between two heartbeats of the hive [s, wall clock].
    """

    def __init__(
        self, now: Callable[[], float], wall: Callable[[], float] = time.monotonic
    ) -> None:
        """Begin with nothing; `now` returns the hive's time, `wall` that of the wall clock [s]."""
        self.legs = self.failed = self.contacts = self.locks = 0
        self.longest_stand = self.heartbeat_gap = 0.0
        self._wall = wall
        self._beat = math.inf
        self._now = now
        self._steps: dict[str, int] = defaultdict(int)
        self._busy: set[str] = set()
        self._moved: dict[str, tuple[float, float, float]] = {}  # when, and to where

    def __call__(self, report: Report | None, _events: Sequence[Event]) -> None:
        """Take in a report."""
        if isinstance(report, TaskUpdate):
            self._count(report)
        elif isinstance(report, RobotStatus):
            if (report.robot_id in self._busy) is not bool(report.task_id):
                self._busy ^= {report.robot_id}
                self._moved.pop(report.robot_id, None)
        elif isinstance(report, TruePlace):
            self._follow(report)
        elif isinstance(report, Heartbeat):
            before, self._beat = self._beat, self._wall()
            self.heartbeat_gap = max(self.heartbeat_gap, self._beat - before)
        elif isinstance(report, Collisions):
            self.contacts = report.total
        elif isinstance(report, TrafficState):
            self.locks = max(self.locks, sum(report.counts.values()))

    def _count(self, update: TaskUpdate) -> None:
        steps = update.steps if update.state is TaskState.DONE else update.step
        if update.state in {TaskState.STARTED, TaskState.DONE}:
            self.legs += max(0, steps - self._steps[update.task_id])
            self._steps[update.task_id] = max(steps, self._steps[update.task_id])
        self.failed += update.state is TaskState.FAILED

    def _follow(self, place: TruePlace) -> None:
        now = self._now()
        since, x, y = self._moved.get(place.robot, (now, math.inf, math.inf))
        if place.robot not in self._busy or math.hypot(place.x - x, place.y - y) > MOVED:
            self._moved[place.robot] = now, place.x, place.y
        else:
            self.longest_stand = max(self.longest_stand, now - since)


def through_ros(connect: Connect, minutes: int) -> BenchResult:
    """Let a hive drive for some simulated minutes, planned and local.

    Returns:
        Of both: goals per hour and robot, tours that failed, contacts, the longest stand of a
        robot with a task [s], the longest time between two heartbeats [s, wall clock]; of the
        planned one how many locks its planner has found; and the planned goals over the local
        ones.
    """
    figures: dict[str, float] = {}
    for traffic in ("planned", "local"):
        found = run_apart(_drive, connect, traffic, 60.0 * minutes)
        figures |= {f"{traffic} {name}": value for name, value in found.items()}
    goals = "goals per hour and robot"
    figures["planned over local"] = figures[f"planned {goals}"] / figures[f"local {goals}"]
    del figures["local locks"]
    contacts = {f"{traffic} contacts": 0.0 for traffic in ("planned", "local")}
    return BenchResult(figures, contacts, any(figures[name] for name in contacts))


def _drive(connect: Connect, traffic: str, seconds: float) -> dict[str, float]:
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        files = write_hall(folder, ROBOTS)
        names = [robot.name for robot in read_fleet(files.fleet).robots]
        hive = stack.enter_context(local_hive(folder))
        click.echo(f"{traffic}: {ROBOTS} robots, {seconds:g} simulated seconds", err=True)
        hive.start_master()
        choices = {"rviz": "false", "gui": "false", "rtf": f"{RTF:g}", "traffic": traffic}
        hive.launch({**files._asdict(), **choices})
        link = stack.enter_context(connect(names))
        account = Account(link.hive_time)
        client = HiveClient(link, account)
        wait_for_everyone(client, names, hive, START_WITHIN)
        tours = Tours(client, ROBOTS, files.world)
        end = link.hive_time() + seconds
        while link.hive_time() < end:
            tours.refill()
            client.pump(lambda: False, 1.0)
            hive.check()
        return {
            "goals per hour and robot": account.legs * HOUR / (seconds * ROBOTS),
            "failed tours": float(account.failed),
            "contacts": float(account.contacts),
            "longest stand": account.longest_stand,
            "heartbeat gap": account.heartbeat_gap,
            "locks": float(account.locks),
        }
