# SPDX-License-Identifier: BSD-3-Clause
"""Runs a scenario on a hive, from the first process to the report.

One thread takes in what the hive says, records it, shows it, and posts what is due.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Any

from blackboard.domain.record import TaskUpdate
from fleet_manager.client.client import Feeder, HiveClient
from fleet_manager.demo.history import History
from fleet_manager.demo.local_hive import wait_for_everyone
from fleet_manager.demo.progress import Progress
from fleet_manager.demo.report import Clocks, make_report
from fleet_manager.errors import NoHiveError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from contextlib import AbstractContextManager
    from typing import TextIO

    from fleet_manager.client.client import ClientLink
    from fleet_manager.client.reports import Report
    from fleet_manager.client.words import Event
    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.config.scenario import Scenario
    from fleet_manager.demo.local_hive import LocalHive

_WALL_SLACK = 4.0  # a run ends after this multiple of its due wall time: the clock hardly runs
_SLOW = 0.9  # a real-time factor under this share of the requested one is worth a remark


Look = Callable[[float, float], None]


def _ignore(_now: float, _ended: float) -> None:
    """Do nothing with the state of a run."""


@dataclass(frozen=True)
class DemoPlan:
    """The plan of a run."""

    scenario: Scenario  # what is posted
    fleet: Fleet  # the robots
    rtf: float  # the requested real-time factor
    windows: bool  # whether RViz and the operator's windows open
    traffic: str = ""  # who decides which robot goes first; empty: as the fleet file says

    @property
    def arguments(self) -> dict[str, str]:
        """The arguments of `fleet_manager.launch`, by name."""
        windows = str(self.windows).lower()
        return {
            "fleet": str(self.fleet.path.resolve()),
            "world": self.scenario.world,
            "map": self.scenario.map,
            "rtf": f"{self.rtf:g}",
            "rviz": windows,
            "gui": windows,
            "traffic": self.traffic,
        }

    @property
    def robots(self) -> list[str]:
        """The names of the robots."""
        return [robot.name for robot in self.fleet.robots]


@dataclass(frozen=True)
class DemoResult:
    """The result of a run."""

    report: dict[str, Any]  # see `report.make_report`
    history: History  # what was recorded
    remarks: list[str]  # what a person should know: what went wrong, what was slow
    # What happened, with the time since the start [s, hive's time].
    log: list[tuple[float, str]] = field(default_factory=list)


class DemoRun:
    """One run on a launched hive, over a link that records the plan's robots.

    `look` is called several times a second with the time since the first posting [s, hive's time]
    and the share of the tasks that have ended, 0..1.
    """

    def __init__(
        self, plan: DemoPlan, hive: LocalHive, link: ClientLink, sink: TextIO, look: Look = _ignore
    ) -> None:
        self._plan = plan
        self._hive = hive
        self._link = link
        self._look = look
        self.client = HiveClient(link, self._hear)  # posts and follows the tasks
        self._ids = [planned.task.id for planned in plan.scenario.tasks]
        self._progress = Progress(sink, plan.robots, self._ids)
        self._history: History | None = None
        self._log: list[tuple[float, str]] = []
        self._begin = 0.0

    def run(self) -> DemoResult:
        """Post the scenario and follow it until every task has ended or the time is up.

        Raises:
            StartError: A process of the hive ended unexpectedly.
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
            self._look(link.hive_time() - hive, self._ended() / len(self._ids))
            self._progress.show(self.client.state, link.now() - wall, link.hive_time() - hive)
        clocks = Clocks(date, self._plan.rtf, link.hive_time() - hive, link.now() - wall)
        self._progress.end(self.client.state, clocks.wall, clocks.hive)
        self._history.close(link.hive_time())
        report = make_report(scenario, self._plan.fleet, self.client.state, self._history, clocks)
        remarks += _speed_remark(clocks)
        return DemoResult(report, self._history, remarks, self._log)

    def _hear(self, report: Report | None, events: Sequence[Event]) -> None:
        """Record and show a report, and what was noticed; silence is noticed without one."""
        if self._history is None:
            return
        now = self._link.hive_time()
        self._log += [(now - self._begin, event.text) for event in events]
        if report is not None:
            self._history.add(now, report)
        if isinstance(report, TaskUpdate):
            self._progress.tell(events, now - self._begin)

    def _all_ended(self) -> bool:
        return self._ended() == len(self._ids)

    def _ended(self) -> int:
        states = (self.client.state.state_of(task_id) for task_id in self._ids)
        return sum(state is not None and state.is_terminal for state in states)

    def _time_up(self, wall: float, hive: float) -> str:
        limit = self._plan.scenario.time_limit
        spent = f"{hive:.0f} s of the hive's time, {wall:.0f} s of real time"
        return f"the time limit of {limit:g} s is over ({spent})"


def run_demo(
    plan: DemoPlan,
    hive: LocalHive,
    connect: Callable[[Sequence[str]], AbstractContextManager[ClientLink]],
    sink: TextIO,
    look: Look = _ignore,
) -> DemoResult:
    """Start a hive, run a scenario on it, and return the result; the caller ends the processes.

    For `look` see `DemoRun`.

    Raises:
        StartError: The hive did not start, or a process ended unexpectedly.
    """
    begin = time.monotonic()
    sink.write("waiting for the ROS master\n")
    hive.start_master()
    hive.launch(plan.arguments)
    with connect(plan.robots) as link:
        run = DemoRun(plan, hive, link, sink, look)
        wait_for_everyone(run.client, plan.robots, hive, tell=sink.write)
        sink.write(f"everyone is there after {time.monotonic() - begin:.0f} s\n")
        return run.run()


def _speed_remark(clocks: Clocks) -> list[str]:
    if clocks.reached_rtf >= _SLOW * clocks.asked_rtf:
        return []
    reached, asked = f"{clocks.reached_rtf:.2f}", f"{clocks.asked_rtf:g}"
    return [f"the real-time factor was {reached}, not {asked}: the machine is too busy"]
