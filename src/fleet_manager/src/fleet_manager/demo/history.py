# SPDX-License-Identifier: BSD-3-Clause
"""Records a run, from what the hive and the simulator say.

`report` and `picture` use the record. Times are the hive's, from the first task [s].
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from math import floor, hypot
from typing import TYPE_CHECKING

from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.reports import BatteryReading, Collisions, TruePlace
from fleet_manager.client.traffic import TrafficState

if TYPE_CHECKING:
    from fleet_manager.client.reports import Report

_PATH_GRAIN = 0.05  # distance between two recorded places [m]: one cell of a map

WAIT_GRAIN = 0.5  # side of the squares by which waiting is counted [m]
_LONGEST_GAP = 20.0  # what is told once a second on the wall is that old in a fast simulation [s]


@dataclass(frozen=True, slots=True)
class Span:
    """A robot's work on a task, from `begin` to `end` [s]; None while it lasts."""

    robot: str
    task_id: str
    begin: float
    end: float | None = None


@dataclass
class TaskTimes:
    """The times of a task [s]; None where something has not happened."""

    posted: float | None = None  # when the blackboard accepted it
    assigned: float | None = None  # when a robot first got it
    started: float | None = None  # when a robot first began it
    ended: float | None = None  # when it reached a terminal state


@dataclass
class RobotTrack:
    """What one robot did; the points of its path are at least 0.05 m apart."""

    path: list[tuple[float, float]] = field(default_factory=list)  # x and y [m, map frame]
    distance: float = 0.0  # driven in total [m]
    charges: list[tuple[float, float]] = field(default_factory=list)  # (time [s], charge 0..1)
    energy: float = 0.0  # drawn from the battery [J]
    _place: tuple[float, float] | None = None
    _reading: BatteryReading | None = None

    def move_to(self, x: float, y: float) -> None:
        """Record the robot's position [m, map frame]."""
        if self._place is not None:
            self.distance += hypot(x - self._place[0], y - self._place[1])
        self._place = (x, y)
        if not self.path or hypot(x - self.path[-1][0], y - self.path[-1][1]) >= _PATH_GRAIN:
            self.path.append((x, y))

    def discharge_to(self, reading: BatteryReading) -> None:
        """Record a battery reading; energy is charge times the mean voltage."""
        last, self._reading = self._reading, reading
        if last is not None and reading.charge < last.charge:
            voltage = (last.voltage + reading.voltage) / 2
            self.energy += (last.charge - reading.charge) * 3600 * voltage


class History:
    """The record of one run; `start` is the time that becomes 0 [s, hive's time]."""

    def __init__(self, start: float) -> None:
        self.tasks: dict[str, TaskTimes] = {}  # the times of each task, by id
        self.tracks: dict[str, RobotTrack] = {}  # what each robot did, by name
        self.spans: list[Span] = []  # which robot worked on which task, in the order they began
        self.collisions = 0  # the number of collisions
        # How long robots waited for each other [s], by square: x and y over WAIT_GRAIN, map frame.
        self.waited: dict[tuple[int, int], float] = defaultdict(float)
        self._traffic_told: float | None = None  # [s, hive's time]
        self._start = start

    def add(self, time: float, report: Report) -> None:
        """Record a report at a time [s, hive's time]; other reports change nothing."""
        now = time - self._start
        if isinstance(report, TruePlace):
            self._track(report.robot).move_to(report.x, report.y)
        elif isinstance(report, BatteryReading):
            self._track(report.robot).discharge_to(report)
        elif isinstance(report, Collisions):
            self.collisions = report.total
        elif isinstance(report, TrafficState):
            self._count_waits(report)
        elif isinstance(report, RobotStatus):
            self._track(report.robot_id).charges.append((now, report.charge))
        elif isinstance(report, TaskUpdate):
            self._note(now, report.task_id, report.state, report.robot_id)
        elif isinstance(report, TaskList):
            for record in report.records:
                self._note(now, record.task.id, record.state, record.robot)

    def close(self, time: float) -> None:
        """End what still lasts, at a time [s, hive's time]."""
        for task_id in self.tasks:
            self._end_span(task_id, time - self._start)

    def _track(self, robot: str) -> RobotTrack:
        return self.tracks.setdefault(robot, RobotTrack())

    def _count_waits(self, state: TrafficState) -> None:
        """Count the time since the traffic planner spoke last for all that wait now."""
        before, self._traffic_told = self._traffic_told, state.time
        if before is None or not 0 < state.time - before <= _LONGEST_GAP:
            return
        for wait in state.waits:
            square = floor(wait.x / WAIT_GRAIN), floor(wait.y / WAIT_GRAIN)
            self.waited[square] += state.time - before

    def _note(self, now: float, task_id: str, state: TaskState, robot: str) -> None:
        """Record the state of a task; the same state twice changes nothing."""
        times = self.tasks.setdefault(task_id, TaskTimes())
        if times.ended is not None:
            return
        if times.posted is None and state is not TaskState.REJECTED:
            times.posted = now
        if state is TaskState.ASSIGNED and times.started is None:
            times.assigned = now if times.assigned is None else times.assigned
        working = state is TaskState.STARTED
        if working and times.started is None:
            times.started = now
        current = self._open_span(task_id)
        if current is not None and not (working and self.spans[current].robot == robot):
            self._end_span(task_id, now)
            current = None
        if working and current is None:
            self.spans.append(Span(robot, task_id, now))
        if state.is_terminal:
            times.ended = now

    def _open_span(self, task_id: str) -> int | None:
        for index in range(len(self.spans) - 1, -1, -1):
            if self.spans[index].task_id == task_id and self.spans[index].end is None:
                return index
        return None

    def _end_span(self, task_id: str, now: float) -> None:
        index = self._open_span(task_id)
        if index is not None:
            span = self.spans[index]
            self.spans[index] = Span(span.robot, span.task_id, span.begin, now)
