# SPDX-License-Identifier: BSD-3-Clause
"""Runs a hive on a scenario from the first process to the report.

One thread does everything: it takes in what the hive says, records it, shows it, and posts what is
due. How processes start and how the hive is reached is handed in.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from fleet_manager.client.client import HiveClient
from fleet_manager.client.feeder import Feeder
from fleet_manager.demo.gathering import wait_for_everyone
from fleet_manager.demo.history import History
from fleet_manager.demo.progress import Progress
from fleet_manager.demo.report import Clocks, make_report
from fleet_manager.errors import NoHiveError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from fleet_manager.client.client import Link
    from fleet_manager.client.hive_view import HiveView, Report
    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.config.scenario import Scenario
    from fleet_manager.demo.local_hive import LocalHive
    from fleet_manager.demo.progress import Sink

_WALL_SLACK = 4.0
"""A run that takes this many times the wall time it should is ended: the clock hardly runs."""

_SLOW = 0.9
"""A reached real-time factor under this share of the asked one is worth a word."""


@dataclass(frozen=True)
class DemoPlan:
    """What is to be run.

    Attributes:
        scenario: What is posted.
        fleet: Who does it.
        rtf: Hive's time per wall time.
        windows: Whether RViz and the operator's windows are opened.
    """

    scenario: Scenario
    fleet: Fleet
    rtf: float
    windows: bool

    @property
    def arguments(self) -> dict[str, str]:
        """Of `fleet_manager.launch`, by name."""
        windows = str(self.windows).lower()
        return {
            "fleet": str(self.fleet.path.resolve()),
            "world": self.scenario.world,
            "map": self.scenario.map,
            "rtf": f"{self.rtf:g}",
            "rviz": windows,
            "gui": windows,
        }

    @property
    def robots(self) -> list[str]:
        """Names of the robots."""
        return [robot.name for robot in self.fleet.robots]


@dataclass(frozen=True)
class DemoResult:
    """What came of a run.

    Attributes:
        report: See `report.make_report`.
        history: What was recorded.
        remarks: Sentences that a person should read: what went wrong, what was slow.
    """

    report: dict[str, Any]
    history: History
    remarks: list[str]


class DemoRun:
    """One run of a hive that has been launched.

    Attributes:
        client: Posts and follows the tasks.
    """

    def __init__(self, plan: DemoPlan, hive: LocalHive, link: Link, sink: Sink) -> None:
        """Begin the record.

        Args:
            plan: What is to be run.
            hive: Its processes, launched.
            link: The way to it; records the plan's robots.
            sink: Where the progress is shown.
        """
        self._plan = plan
        self._hive = hive
        self._link = link
        self.client = HiveClient(link, self._hear)
        self._ids = [planned.task.id for planned in plan.scenario.tasks]
        self._progress = Progress(sink, plan.robots, self._ids)
        self._history: History | None = None
        self._begin = 0.0

    def run(self) -> DemoResult:
        """Post the scenario and follow it until every task has ended or the time is up.

        Raises:
            StartError: A process of the hive has ended by itself.
        """
        scenario, link = self._plan.scenario, self._link
        date = datetime.now().astimezone().isoformat(timespec="seconds")
        wall, hive = link.now(), link.hive_time()
        self._begin = hive
        self._history = History(hive)
        feeder = Feeder(self.client, scenario.tasks)
        remarks: list[str] = []
        longest = _WALL_SLACK * scenario.time_limit / self._plan.rtf
        while not (feeder.done and self._all_ended()):
            if link.hive_time() - hive > scenario.time_limit or link.now() - wall > longest:
                remarks.append(self._time_up(link.now() - wall, link.hive_time() - hive))
                break
            try:
                feeder.post_due()
            except NoHiveError as error:
                remarks.append(str(error))
                break
            self.client.pump(self._all_ended, feeder.next_in(most=0.25))
            self._hive.check()
            self._progress.show(self.client.view, link.now() - wall, link.hive_time() - hive)
        clocks = Clocks(date, self._plan.rtf, link.hive_time() - hive, link.now() - wall)
        self._progress.end(self.client.view, clocks.wall, clocks.hive)
        self._history.close(link.hive_time())
        report = make_report(scenario, self._plan.fleet, self.client.view, self._history, clocks)
        return DemoResult(report, self._history, remarks + _speed_remark(clocks))

    def _hear(self, view: HiveView, report: Report) -> None:
        """Record and show one report."""
        if self._history is not None:
            now = self._link.hive_time()
            self._history.add(now, report)
            self._progress.tell(view, report, now - self._begin)

    def _all_ended(self) -> bool:
        states = (self.client.view.state_of(task_id) for task_id in self._ids)
        return all(state is not None and state.is_terminal for state in states)

    def _time_up(self, wall: float, hive: float) -> str:
        limit = self._plan.scenario.time_limit
        return (
            f"the time limit of {limit:g} s is over ({hive:.0f} s of the hive, {wall:.0f} s here)"
        )


def run_demo(
    plan: DemoPlan,
    hive: LocalHive,
    connect: Callable[[Sequence[str]], AbstractContextManager[Link]],
    sink: Sink,
) -> DemoResult:
    """Start a hive, run a scenario on it, and return what came of it.

    Args:
        plan: What is to be run.
        hive: The processes; the caller ends them.
        connect: Opens the link; see `cli.outside.Outside`.
        sink: Where the progress is shown.

    Raises:
        StartError: The hive did not come up, or a part of it ended by itself.
    """
    begin = time.monotonic()
    hive.start_master()
    hive.launch(plan.arguments)
    with connect(plan.robots) as link:
        run = DemoRun(plan, hive, link, sink)
        wait_for_everyone(run.client, plan.robots, hive)
        sink.write(f"everyone is there after {time.monotonic() - begin:.0f} s\n")
        return run.run()


def _speed_remark(clocks: Clocks) -> list[str]:
    if clocks.reached_rtf >= _SLOW * clocks.asked_rtf:
        return []
    reached, asked = f"{clocks.reached_rtf:.2f}", f"{clocks.asked_rtf:g}"
    return [f"the real-time factor was {reached}, not {asked}: the machine is too busy for it"]
