# SPDX-License-Identifier: BSD-3-Clause
"""The ordered list of a robot's tasks, and what adding one more to it would take.

The list is ordered by priority; among equals a new task goes to the best place: where it lengthens
the robot's way least, unless the cost model asks for another. What is being done now keeps its
place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from blackboard.cost import friction_force
from blackboard.placement import Placement, place_rule
from blackboard.record import TaskUpdate
from blackboard.task import (
    StepKind,
    TaskState,
    is_picked,
    load_during,
    split_task,
    step_to_go_on,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blackboard.pose import Pose
    from blackboard.record import Order, TaskRecord
    from blackboard.robot import RobotCharacteristics
    from blackboard.task import Task
    from blackboard.ways import Ways

# A robot accelerates, turns on the spot and gives way to others: the mean of its speed over the
# drives of the demo is about this share of its greatest speed (docs/benchmarks.md).
MEAN_SPEED_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Effort:
    """What it takes a robot to do a task from a place on.

    Attributes:
        way: How far it drives [m]; infinite where there is no way.
        energy: What it draws [J].
        duration: How long it takes [s].
        end: Where it stands afterwards.
    """

    way: float
    energy: float
    duration: float
    end: Pose


def effort(
    task: Task,
    first_step: int,
    start: Pose,
    robot: RobotCharacteristics,
    ways: Ways,
    steps: int | None = None,
) -> Effort:
    """Predict what it takes a robot to do the rest of a task, or the next steps of it.

    Args:
        task: A task that `analyze_task` has passed.
        first_step: The first step that is still to be done.
        start: Where the robot begins.
        robot: What the robot is.
        ways: Knows how far it is.
        steps: How many steps count; all that are left where none is given.
    """
    last_step = math.inf if steps is None else first_step + steps
    way = energy = duration = 0.0
    here = start
    for index, step in enumerate(split_task(task)):
        if not first_step <= index < last_step:
            continue
        if step.kind is StepKind.MOVE:
            leg = ways.length(here, step.goal)
            mass = robot.mass + load_during(task, index)
            way += leg
            energy += friction_force(robot.friction_coefficient, mass) * leg
            duration += leg / (MEAN_SPEED_SHARE * robot.max_speed)
            here = step.goal
        else:
            energy += robot.arm_power * robot.arm_time(step.kind)
            duration += robot.arm_time(step.kind)
    return Effort(way, energy + robot.idle_power * duration, duration, here)


@dataclass(frozen=True, slots=True)
class Entry:
    """A task in a robot's list.

    Attributes:
        order: As it was ordered.
        step: The next step to do.
        known: The step that the task list shows to be under way; -1 where it shows none yet.
    """

    order: Order
    step: int = 0
    known: int = -1

    @property
    def task(self) -> Task:
        """The task."""
        return self.order.task

    @property
    def steps(self) -> int:
        """The number of steps of the task."""
        return len(split_task(self.task))

    @property
    def is_announced(self) -> bool:
        """Whether the next step may be begun as far as the hive's task list goes.

        Before a load is taken on board, the list has to show that it is going to be: it says where
        to look for the load if the robot is lost.
        """
        if self.step >= self.steps or split_task(self.task)[self.step].kind is not StepKind.PICK:
            return True
        return max(self.known, self.order.step) >= self.step

    def update(self, state: TaskState, **fields: object) -> TaskUpdate:
        """Return what the robot reports of it; further fields by name."""
        report = TaskUpdate(
            task_id=self.task.id,
            state=state,
            robot_id=self.order.robot_id,
            step=self.step,
            steps=self.steps,
            epoch=self.order.epoch,
            assignment=self.order.assignment,
        )
        return replace(report, **fields)  # type: ignore[arg-type]  # fields by name


class Itinerary:
    """A robot's tasks in the order it will do them.

    Args:
        robot: What the robot is.
        ways: Knows how far it is.
        cost_model: By its name; says what is to be least at the best place for one more task.
    """

    def __init__(
        self, robot: RobotCharacteristics, ways: Ways, cost_model: str = "report"
    ) -> None:
        self._robot = robot
        self._ways = ways
        self._rule = place_rule(cost_model)
        self._entries: list[Entry] = []

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def get(self, task_id: str) -> Entry | None:
        """Return the entry of a task, or None where it is not on the list."""
        return next((entry for entry in self._entries if entry.task.id == task_id), None)

    def first(self) -> Entry | None:
        """Return what is to be done now, or None when the list is empty."""
        return self._entries[0] if self._entries else None

    def insert(self, order: Order, here: Pose, *, keep_first: bool) -> None:
        """Add an ordered task at its best place, or first of all where its load is on board."""
        step = step_to_go_on(order.task, order.step)
        index = 0
        if not is_picked(order.task, step):
            index = self.best_place(order.task, step, here, keep_first=keep_first).index
        self._entries.insert(index, Entry(order, step))

    def remove(self, task_id: str) -> None:
        """Take a task off; harmless where it is not on the list."""
        self._entries = [entry for entry in self._entries if entry.task.id != task_id]

    def advance(self, task_id: str, step: int) -> None:
        """Note the next step of a task to do."""
        self._change(task_id, step=step)

    def note_known(self, record: TaskRecord) -> None:
        """Note which step of a task on the list the hive's task list shows to be under way."""
        entry = self.get(record.task.id)
        if entry is None or record.assignment != entry.order.assignment:
            return
        if record.state is TaskState.STARTED:
            self._change(record.task.id, known=record.step)

    def renew(self, order: Order) -> None:
        """Note that a task on the list has been ordered anew; what was done of it stays done."""
        self._change(order.task.id, order=order, known=-1)

    def best_place(self, task: Task, step: int, here: Pose, *, keep_first: bool) -> Placement:
        """Find the best place for one more task that does not pass a higher priority.

        Args:
            task: A task that `analyze_task` has passed.
            step: Its first step that is still to be done.
            here: Where the robot stands.
            keep_first: Whether the first task on the list is being done and stays there.
        """
        ahead = sum(
            1
            for index, entry in enumerate(self._entries)
            if entry.task.priority > task.priority or (keep_first and index == 0)
        )
        equals = sum(1 for entry in self._entries[ahead:] if entry.task.priority == task.priority)
        road = [Effort(0.0, 0.0, 0.0, here), *self._run(self._entries, here)]
        places = [
            self._place(index, task, step, road) for index in range(ahead, ahead + equals + 1)
        ]
        return min(places, key=lambda place: (self._rule(place), place.index))

    def next_step(self, here: Pose) -> Effort:
        """Return what the next step of the first task on the list takes; there has to be one."""
        entry = self._entries[0]
        return effort(entry.task, entry.step, here, self._robot, self._ways, steps=1)

    def predict(self, task: Task, first_step: int, start: Pose) -> Effort:
        """Return what the rest of any task takes this robot; see `effort`."""
        return effort(task, first_step, start, self._robot, self._ways)

    def ahead(self, here: Pose) -> list[Effort]:
        """Return, for each task on the list, what the robot has done from here when it is done."""
        return self._run(self._entries, here)

    def _change(self, task_id: str, **changes: object) -> None:
        self._entries = [
            replace(entry, **changes) if entry.task.id == task_id else entry  # type: ignore[arg-type]  # fields by name
            for entry in self._entries
        ]

    def _place(self, index: int, task: Task, step: int, road: list[Effort]) -> Placement:
        """Return what a place is like; `road` holds what is done before each place."""
        before = road[index]
        own = effort(task, step, before.end, self._robot, self._ways)
        added, longer = own.way, own.duration
        behind = self._entries[index:]
        if behind:
            rest = behind[0].task, behind[0].step
            after = effort(*rest, own.end, self._robot, self._ways)
            now = effort(*rest, before.end, self._robot, self._ways)
            added += after.way - now.way
            longer += after.duration - now.duration
        waiting = before.duration + own.duration + len(behind) * longer
        return Placement(index, own, added, before, road[-1].duration + longer, waiting)

    def _run(self, entries: list[Entry], here: Pose) -> list[Effort]:
        """Return the running totals of doing some entries one after the other."""
        totals = []
        way = energy = duration = 0.0
        for entry in entries:
            part = effort(entry.task, entry.step, here, self._robot, self._ways)
            way, energy, duration = way + part.way, energy + part.energy, duration + part.duration
            here = part.end
            totals.append(Effort(way, energy, duration, here))
        return totals
