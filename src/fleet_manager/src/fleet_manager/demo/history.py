# SPDX-License-Identifier: BSD-3-Clause
"""Keeps what happened to a hive, from what it says and what the simulator counts.

Collects only; figures are made of it by `report`, the picture by `picture`. Times are the hive's
clock, counted from the first task.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot
from typing import TYPE_CHECKING

from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.samples import BatteryReading, Collisions, TruePlace

if TYPE_CHECKING:
    from fleet_manager.client.hive_view import Report

_PATH_GRAIN = 0.05
"""Places closer to each other than this are not kept for the picture [m]: one cell of a map."""


@dataclass(frozen=True, slots=True)
class Span:
    """A robot at work on a task.

    Attributes:
        robot: The robot.
        task_id: The task.
        begin: [s]
        end: [s]; None while it lasts.
    """

    robot: str
    task_id: str
    begin: float
    end: float | None = None


@dataclass
class TaskTimes:
    """When what happened to a task [s]; None where it has not.

    Attributes:
        posted: Taken in by the blackboard.
        assigned: Given to a robot for the last time.
        started: Begun for the first time.
        ended: In one of the terminal states.
    """

    posted: float | None = None
    assigned: float | None = None
    started: float | None = None
    ended: float | None = None


@dataclass
class RobotTrack:
    """What one robot did.

    Attributes:
        path: Places in the map frame, no two neighbours closer than 0.05 m: (x, y) [m].
        distance: Driven in all [m].
        charges: (time [s], charge 0..1).
        energy: Drawn from the battery so far [J].
    """

    path: list[tuple[float, float]] = field(default_factory=list)
    distance: float = 0.0
    charges: list[tuple[float, float]] = field(default_factory=list)
    energy: float = 0.0
    _place: tuple[float, float] | None = None
    _reading: BatteryReading | None = None

    def move_to(self, x: float, y: float) -> None:
        """Note where the robot is now [m]."""
        if self._place is not None:
            self.distance += hypot(x - self._place[0], y - self._place[1])
        self._place = (x, y)
        if not self.path or hypot(x - self.path[-1][0], y - self.path[-1][1]) >= _PATH_GRAIN:
            self.path.append((x, y))

    def discharge_to(self, reading: BatteryReading) -> None:
        """Note what the battery says now; the energy is charge times the voltage meanwhile."""
        last, self._reading = self._reading, reading
        if last is not None and reading.charge < last.charge:
            voltage = (last.voltage + reading.voltage) / 2
            self.energy += (last.charge - reading.charge) * 3600 * voltage


class History:
    """Everything that is kept of one run.

    Attributes:
        tasks: When what happened to each task, by id.
        tracks: What each robot did, by name.
        spans: Who was at work on what, in the order they began.
        collisions: Collisions since the beginning of the record.
    """

    def __init__(self, start: float) -> None:
        """Begin at `start` [s] on the hive's clock, which becomes time 0."""
        self.tasks: dict[str, TaskTimes] = {}
        self.tracks: dict[str, RobotTrack] = {}
        self.spans: list[Span] = []
        self.collisions = 0
        self._start = start

    def add(self, time: float, report: Report) -> None:
        """Note one thing that the hive or the simulator said.

        Args:
            time: When, on the hive's clock [s].
            report: What was said; what is of no interest here is passed over.
        """
        now = time - self._start
        if isinstance(report, TruePlace):
            self._track(report.robot).move_to(report.x, report.y)
        elif isinstance(report, BatteryReading):
            self._track(report.robot).discharge_to(report)
        elif isinstance(report, Collisions):
            self.collisions = report.total
        elif isinstance(report, RobotStatus):
            self._track(report.robot_id).charges.append((now, report.charge))
        elif isinstance(report, TaskUpdate):
            self._note(now, report.task_id, report.state, report.robot_id)
        elif isinstance(report, TaskList):
            for record in report.records:
                self._note(now, record.task.id, record.state, record.robot)

    def close(self, time: float) -> None:
        """End what still lasts, at `time` on the hive's clock [s]."""
        for task_id in self.tasks:
            self._end_span(task_id, time - self._start)

    def _track(self, robot: str) -> RobotTrack:
        return self.tracks.setdefault(robot, RobotTrack())

    def _note(self, now: float, task_id: str, state: TaskState, robot: str) -> None:
        """Note where a task stands; the same said twice changes nothing."""
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
