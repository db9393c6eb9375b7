# SPDX-License-Identifier: BSD-3-Clause
"""A hive and its link for tests: no ROS, no waiting, time that jumps."""

from __future__ import annotations

import io
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.reports import HiveMessage

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from blackboard.domain.task import Task
    from fleet_manager.client.reports import Report
    from fleet_manager.client.traffic import ZoneCommand
    from hive_common.pose import Pose


class FakeLink:
    """A link whose time passes only while somebody waits.

    Attributes:
        posted: Every published task, repetitions included.
        cancelled: Every id published on `task_cancel`.
        on_post: Called with each published task; the test's hive answers from it.
        on_cancel: Called with each cancelled id.
        switched: Every command published on `zone_command`.
        on_switch: Called with each of them.
        robots: Those that are known to be there; None while nobody knows.
        told: Every word to a robot, as (robot, word).
        on_set_state: Called with each of them.
        known_places: The named places of the building.
        radii: How close the middle of each robot may come to what is blocked [m].
        learned: What the parameter `learned` of each robot holds.
        maps: Every file that the map server was to read.
        on_change_map: Called with each of them.
        wrong: What members and nodes say is wrong.
        clock_at: When the hive's time becomes known [s]; 0 before that.
        epoch: The hive's time when this link was made [s].
    """

    def __init__(self) -> None:
        self.posted: list[Task] = []
        self.cancelled: list[str] = []
        self.on_post: Callable[[Task], None] = lambda _task: None
        self.on_cancel: Callable[[str], None] = lambda _task_id: None
        self.switched: list[ZoneCommand] = []
        self.on_switch: Callable[[ZoneCommand], None] = lambda _command: None
        self.robots: set[str] | None = None
        self.told: list[tuple[str, str]] = []
        self.on_set_state: Callable[[str, str], None] = lambda _robot, _word: None
        self.known_places: dict[str, Pose] = {}
        self.radii: dict[str, float] = {}
        self.learned: dict[str, object] = {}
        self.maps: list[Path] = []
        self.on_change_map: Callable[[Path], None] = lambda _path: None
        self.wrong: tuple[str, ...] = ()
        self.clock_at = 0.0
        self.epoch = 100.0
        self._heard: set[str] = set()
        self._time = 0.0
        self._reports: deque[tuple[float, Report]] = deque()

    def say(self, report: Report, after: float = 0.0) -> None:
        """Have the hive report something, `after` seconds from now."""
        self._reports.append((self._time + after, report))
        self._reports = deque(sorted(self._reports, key=lambda item: item[0]))

    def listen(self, *names: str) -> None:
        """Do nothing: everything that is said arrives."""

    def has_heard_robots(self) -> bool:
        """Return whether every report of `robots` has been received."""
        return self.robots is not None and self.robots <= self._heard

    def troubles(self) -> tuple[str, ...]:
        """Return `wrong`."""
        return self.wrong

    def reconnect(self) -> None:
        """Drop what has not been received, as a program does when it ends."""
        self._reports.clear()

    def now(self) -> float:
        """Return the virtual time [s]."""
        return self._time

    def hive_time(self, within: float = 0.0) -> float:
        """Return the time since `clock_at`, which is waited for, as long as `within` [s]."""
        self._time += min(max(self.clock_at - self._time, 0.0), within)
        return self.epoch + self._time if self._time >= self.clock_at else 0.0

    def post(self, task: Task) -> None:
        """Record a task, and let the test's hive answer."""
        self.posted.append(task)
        self.on_post(task)

    def cancel(self, task_id: str) -> None:
        """Record a cancellation, and let the test's hive answer."""
        self.cancelled.append(task_id)
        self.on_cancel(task_id)

    def switch(self, command: ZoneCommand) -> None:
        """Record a command, and let the test's planner answer."""
        self.switched.append(command)
        self.on_switch(command)

    def set_state(self, robot: str, word: str) -> None:
        """Record a word, and let the test's robot obey."""
        self.told.append((robot, word))
        self.on_set_state(robot, word)

    def places(self) -> Mapping[str, Pose]:
        """Return `known_places`."""
        return self.known_places

    def radius_of(self, robot: str) -> float | None:
        """Return the robot's radius of `radii`."""
        return self.radii.get(robot)

    def learned_of(self, robot: str) -> object:
        """Return the robot's content of `learned`."""
        return self.learned.get(robot)

    def change_map(self, path: Path) -> None:
        """Record a file, and let the test's map server answer."""
        self.maps.append(path)
        self.on_change_map(path)

    def receive(self, timeout: float) -> HiveMessage | None:
        """Return the next report due within `timeout` [s]; time passes until then."""
        end = self._time + timeout
        if self._reports and self._reports[0][0] <= end:
            due, report = self._reports.popleft()
            self._time = max(self._time, due)
            if isinstance(report, RobotStatus):
                self._heard.add(report.robot_id)
            return HiveMessage(report, self.hive_time())
        self._time = end
        return None


class FakeHive:
    """A blackboard that accepts every task and answers as the real one does."""

    def __init__(self, link: FakeLink, deaf: int = 0) -> None:
        self.records: dict[str, TaskRecord] = {}  # its task list, by id
        self.deaf = deaf  # the number of publications it misses before it hears one
        self._link = link
        self._version = 0
        link.on_post = self._take_in
        link.on_cancel = self._cancel

    def start(self) -> None:
        """Tell a new program who leads and what is on the task list."""
        self._link.reconnect()
        self._link.say(Heartbeat(1, "/blackboard", "", ("/blackboard",)))
        self._say_list()

    def change(self, task_id: str, state: TaskState, robot: str = "", after: float = 0.0) -> None:
        """Have a robot or an operator change a task, `after` seconds from now."""
        record = replace(self.records[task_id], state=state, robot=robot)
        self.records[task_id] = record
        update = TaskUpdate(task_id, state, robot, record.step, record.steps, epoch=1)
        self._link.say(update, after)

    def _take_in(self, task: Task) -> None:
        if self.deaf:
            self.deaf -= 1
            return
        record = self.records.setdefault(task.id, TaskRecord(task))
        if not record.task.asks_the_same_as(task):
            reason = f"id {task.id} is taken by another task"
            self._link.say(TaskUpdate(task.id, TaskState.REJECTED, reason=reason))
            return
        self._link.say(record.told(1))
        self._say_list()

    def _cancel(self, task_id: str) -> None:
        if self.deaf:
            self.deaf -= 1
        elif task_id in self.records:
            self.change(task_id, TaskState.CANCELLED)

    def _say_list(self) -> None:
        self._version += 1
        self._link.say(TaskList(1, self._version, tuple(self.records.values())))


class Keyboard(io.StringIO):
    """What a person types at a terminal."""

    def isatty(self) -> bool:
        """Return True."""
        return True
