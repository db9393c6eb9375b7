# SPDX-License-Identifier: BSD-3-Clause
"""A fake hive with many tasks and robots, for measuring the windows."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

if TYPE_CHECKING:
    import random

_STATES = tuple(state for state in TaskState if state is not TaskState.REJECTED)
_MOVING = (TaskState.WAITING, TaskState.ASSIGNED, TaskState.STARTED)
_REASONS = {
    TaskState.FAILED: "the way to A is blocked by a pallet; clear it and send the task again",
    TaskState.WAITING: "no robot in service can lift 24 kg; robot3 could once it is charged",
}
_WIDTH, _DEPTH = 60.0, 40.0  # of the hall [m]
_ETA = 40.0  # [s]


class FakeFleet:
    """Tasks T1, T2, ... and robots robot1, robot2, ... that change at random.

    The newest task was posted at `now` [s], which also tells this hive from earlier ones.
    """

    def __init__(self, tasks: int, robots: int, now: float, generator: random.Random) -> None:
        self._random = generator
        self._robots = [f"robot{number}" for number in range(1, robots + 1)]
        records = (self._record(number, now - 3.0 * number) for number in range(1, tasks + 1))
        self._records = {record.task.id: record for record in records}
        self._hive = f"fake-{now}"
        self._version = 0
        self._progress = 0

    def beat(self) -> Heartbeat:
        """Return the next heartbeat."""
        self._progress += 1
        members = ("blackboard", "robot1")
        return Heartbeat(1, "blackboard", "robot1", members, self._progress, hive=self._hive)

    def list(self) -> TaskList:
        """Return the whole task list."""
        self._version += 1
        return TaskList(1, self._version, tuple(self._records.values()), self._hive)

    def change(self) -> TaskUpdate:
        """Change a random task."""
        before = self._random.choice(list(self._records.values()))
        state = self._random.choice(_MOVING)
        robot = "" if state is TaskState.WAITING else self._random.choice(self._robots)
        after = replace(before, state=state, robot=robot, step=0, eta=_ETA)
        self._records[after.task.id] = after
        return TaskUpdate(after.task.id, state, robot, 0, after.steps, after.eta, 1, after.reason)

    def report(self, number: int) -> RobotStatus:
        """Return the status of a robot, by its number from 0."""
        name = self._robots[number]
        mine = [
            r.task.id
            for r in self._records.values()
            if r.robot == name and r.state < TaskState.DONE
        ]
        state = RobotState.BUSY if mine else RobotState.IDLE
        charge = self._random.uniform(0.05, 1.0)
        return RobotStatus(
            name, state, self._pose(), charge, 2.5, "".join(mine[:1]), "", tuple(mine[:5])
        )

    def _record(self, number: int, posted: float) -> TaskRecord:
        kind = TaskType(number % len(TaskType))
        goals = tuple(self._pose() for _goal in range(kind.goals_needed))
        payload = self._random.randrange(50) / 2
        task = Task(f"T{number}", kind, goals, number % 11, payload, "map", posted)
        state = _STATES[number % len(_STATES)]
        robot = "" if state is TaskState.WAITING else self._random.choice(self._robots)
        return TaskRecord(task, state, robot, eta=_ETA, reason=_REASONS.get(state, ""))

    def _pose(self) -> Pose:
        x, y = self._random.uniform(0.0, _WIDTH), self._random.uniform(0.0, _DEPTH)
        return Pose(x, y, self._random.uniform(-math.pi, math.pi))
