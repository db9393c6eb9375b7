# SPDX-License-Identifier: BSD-3-Clause
"""The ordered list of a robot's tasks, and what adding one more to it would take.

The list is ordered by priority; among equals a new task goes to the best place: where it lengthens
the robot's way least, unless the cost model asks for another. What is being done now keeps its
place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

from blackboard.costing.aging import Aging
from blackboard.costing.effort import Effort, Job, effort
from blackboard.costing.insertion import Route, Stop, place_rule
from blackboard.costing.pace import Pace
from blackboard.domain.record import OrderKind, TaskUpdate
from blackboard.domain.task import (
    StepKind,
    TaskState,
    is_picked,
    split_task,
    step_to_go_on,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Order, TaskRecord
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


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

    def yields_to(self, order: Order, under_way: Entry | None) -> bool:
        """Return whether an order to take the task back means this assignment of it, as it is.

        Args:
            order: To drop it, or to hand it back.
            under_way: What the robot has begun.
        """
        begun = self is under_way
        return self.order.assignment <= order.assignment and not (
            begun and order.kind is OrderKind.HAND_BACK_UNBEGUN
        )

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


class Schedule:
    """A robot's tasks in the order it will do them.

    Args:
        robot: What the robot is.
        ways: Knows how far it is.
        cost_model: By its name; says what is to be least at the best place for one more task.
        aging: Says what a second of waiting counts; the same for all, where it is left out.
        pace: Knows how long the robot's drives take; the rule of thumb, where it is left out.
    """

    def __init__(
        self,
        robot: RobotCharacteristics,
        path_lengths: PathLengths,
        cost_model: str = "report",
        aging: Aging | None = None,
        pace: Pace | None = None,
    ) -> None:
        self._robot = robot
        self._path_lengths = path_lengths
        self._rule = place_rule(cost_model)
        self._aging = aging or Aging()
        self._pace = pace or Pace(robot.max_speed)
        self._entries: list[Entry] = []

    @property
    def pace(self) -> Pace:
        """How long the robot's drives take."""
        return self._pace

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
            route = self.route(here, at_work=keep_first)
            index = route.best_place((order.task, step)).index
        self._entries.insert(index, Entry(order, step))

    def restore(self, entries: Iterable[Entry]) -> None:
        """Take over a list as it is, in place of what was on this one."""
        self._entries = list(entries)

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

    def route(self, here: Pose, *, at_work: bool, without: Collection[str] = ()) -> Route:
        """Return the list as it is now, to work out where one more task goes best.

        Args:
            here: Where the robot stands.
            at_work: Whether the first task on the list is being done and stays there.
            without: Ids of tasks that are left out.
        """
        stops = [
            Stop(
                entry.task.priority,
                Job(entry.task, entry.step, self._robot, self._path_lengths, pace=self._pace),
                self._aging.weight(entry.task),
            )
            for entry in self._entries
            if entry.task.id not in without
        ]
        return Route(
            here,
            stops,
            self._robot,
            self._path_lengths,
            self._rule,
            keep_first=at_work,
            aging=self._aging,
            pace=self._pace,
        )

    def next_step(self, here: Pose) -> Effort:
        """Return what the next step of the first task on the list takes; there has to be one."""
        entry = self._entries[0]
        return effort(
            entry.task, entry.step, here, self._robot, self._path_lengths, steps=1, pace=self._pace
        )

    def promise(self, here: Pose) -> dict[str, float]:
        """Return `eta` and `step_eta` [s] of the first task on the list, which has to be there.

        Empty where there is no way to it.
        """
        eta = self.ahead(here)[0].duration
        return {"eta": eta, "step_eta": self.next_step(here).duration} if isfinite(eta) else {}

    def predict(self, task: Task, first_step: int, start: Pose) -> Effort:
        """Return what the rest of any task takes this robot; see `effort`."""
        return effort(task, first_step, start, self._robot, self._path_lengths, pace=self._pace)

    def ahead(self, here: Pose) -> list[Effort]:
        """Return, for each task on the list, what the robot has done from here when it is done."""
        return list(self.route(here, at_work=False).before[1:])

    def _change(self, task_id: str, **changes: object) -> None:
        self._entries = [
            replace(entry, **changes) if entry.task.id == task_id else entry  # type: ignore[arg-type]  # fields by name
            for entry in self._entries
        ]
