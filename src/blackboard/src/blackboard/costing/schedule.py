# SPDX-License-Identifier: BSD-3-Clause
"""A robot's tasks in order, and what adding one more would take.

The schedule is ordered by priority. Among equals a new task goes where it lengthens the robot's
path least, unless the cost model asks for something else. The task under way keeps its position.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING

from blackboard.costing.effort import Effort, Job, Predictor
from blackboard.costing.experience import Experience
from blackboard.costing.insertion import INSERTION_RULES, Aging, Route, Stop, shortest
from blackboard.domain.record import OrderKind, TaskUpdate
from blackboard.domain.task import StepKind, TaskState, is_picked, split_task, step_to_go_on

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Order, TaskRecord
    from blackboard.domain.task import Task
    from hive_common.pose import Pose


@dataclass(frozen=True, slots=True)
class Entry:
    """A task on a robot's schedule."""

    order: Order  # as it was ordered
    step: int = 0  # the next step to do
    known: int = -1  # the step that the task list shows to be under way; -1 if it shows none yet

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
        """Whether the next step may begin as far as the task list goes.

        Before a load is taken on board, the list has to show that it is going to be: it says where
        to look for the load if the robot is lost.
        """
        if self.step >= self.steps or split_task(self.task)[self.step].kind is not StepKind.PICK:
            return True
        return max(self.known, self.order.step) >= self.step

    def yields_to(self, order: Order, under_way: Entry | None) -> bool:
        """Return whether an order to take back its task means this assignment, as it stands."""
        keeps = self is under_way and order.kind is OrderKind.HAND_BACK_UNBEGUN
        means_it = self.order.assignment == order.assignment or self.is_older_than(order)
        return means_it and not keeps

    def is_older_than(self, order: Order) -> bool:
        """Return whether an order is about a later assignment of its task.

        Every hive counts its own assignments. What the robot holds of a hive that it has left is
        older than any of its present hive.
        """
        later = self.order.assignment < order.assignment
        return later or self.order.hive != order.hive

    def is_of_an_earlier_task(self, order: Order) -> bool:
        """Return whether an order is about a later task with its id, so that its own is forgotten.

        Another hive may have given the same task another stamp.
        """
        return self.order.hive == order.hive and not self.task.was_posted_at(order.task.posted)

    def update(self, state: TaskState, **fields: object) -> TaskUpdate:
        """Return what the robot reports about it; further fields by name."""
        return TaskUpdate(
            task_id=self.task.id,
            state=state,
            robot_id=self.order.robot_id,
            step=self.step,
            steps=self.steps,
            epoch=self.order.epoch,
            assignment=self.order.assignment,
            **fields,  # type: ignore[arg-type]  # fields by name
        )


class Schedule:
    """A robot's tasks in the order it will do them.

    Args:
        cost_model: By its name; says what is least at the best position for one more task.
        aging: Says what a second of waiting counts; by default the same for all.
        experience: Knows what the robot's steps take; the formula by default.

    Attributes:
        predictor: Predicts what tasks take the robot.
        formula: Predicts it as if the robot had learned nothing.
        rule: What is least at the best position for one more task; set by the cost model.
    """

    def __init__(
        self,
        robot: RobotCharacteristics,
        path_lengths: PathLengths,
        cost_model: str = "report",
        aging: Aging | None = None,
        experience: Experience | None = None,
    ) -> None:
        self.experience = experience or Experience(robot)
        self.predictor = Predictor(robot, path_lengths, self.experience)
        self.formula = Predictor(robot, path_lengths)
        self.rule = INSERTION_RULES.get(cost_model, shortest)
        self._aging = aging or Aging()
        self._entries: list[Entry] = []

    def __iter__(self) -> Iterator[Entry]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def get(self, task_id: str) -> Entry | None:
        """Return the entry of a task; None if it is not on the schedule."""
        return next((entry for entry in self._entries if entry.task.id == task_id), None)

    def first(self) -> Entry | None:
        """Return what is to be done now; None if the schedule is empty."""
        return self._entries[0] if self._entries else None

    def insert(self, order: Order, here: Pose, *, keep_first: bool, loaded: bool = False) -> None:
        """Add an ordered task where the order says, or at its best position.

        One whose load is on board, or may be (`loaded`), goes first.
        """
        step = step_to_go_on(order.task, order.step)
        loaded = loaded or is_picked(order.task, step)
        position = 0
        if order.place and not loaded:
            position = self._allowed(order, keep_first=keep_first)
        elif not loaded:
            route = self.route(here, at_work=keep_first)
            position = route.best_insertion(order.task, step).position
        self._entries.insert(position, Entry(order, step))

    def move(self, order: Order, *, keep_first: bool) -> None:
        """Put a task of the schedule where an order says; what is under way stays first."""
        entry = self.get(order.task.id)
        if entry is None or (keep_first and entry is self.first()):
            return
        self.remove(order.task.id)
        self._entries.insert(self._allowed(order, keep_first=keep_first), entry)

    def _allowed(self, order: Order, *, keep_first: bool) -> int:
        """Return the position nearest to an order's place that priorities allow."""
        priorities = [entry.task.priority for entry in self._entries]
        entry = self.first()
        loaded = entry is not None and is_picked(entry.task, entry.step)
        first = 1 if entry is not None and (keep_first or loaded) else 0
        rest = priorities[first:]
        least = first + sum(priority > order.task.priority for priority in rest)
        most = least + sum(priority == order.task.priority for priority in rest)
        return min(max(order.place - 1, least), most)

    def restore(self, entries: Iterable[Entry]) -> None:
        """Replace the whole schedule."""
        self._entries = list(entries)

    def remove(self, task_id: str) -> None:
        """Remove a task; harmless if it is not there."""
        self._entries = [entry for entry in self._entries if entry.task.id != task_id]

    def advance(self, task_id: str, step: int) -> None:
        """Note the next step of a task."""
        self._change(task_id, step=step)

    def note_known(self, record: TaskRecord) -> None:
        """Note which step of a task the hive's task list shows to be under way."""
        entry = self.get(record.task.id)
        if entry is None or record.assignment != entry.order.assignment:
            return
        if record.state is TaskState.STARTED:
            self._change(record.task.id, known=record.step)

    def renew(self, order: Order) -> None:
        """Note that a scheduled task was ordered again; what was done of it stays done."""
        self._change(order.task.id, order=order, known=-1)

    def route(self, here: Pose, *, at_work: bool, without: Collection[str] = ()) -> Route:
        """Return the schedule as it is now, to find where one more task goes best.

        `at_work` says whether the first task is under way and stays first; `without` holds the ids
        of tasks that are left out.
        """
        stops = [
            Stop(
                entry.task.priority,
                Job(entry.task, entry.step, self.predictor),
                self._aging.weight(entry.task),
            )
            for entry in self._entries
            if entry.task.id not in without
        ]
        return Route(here, stops, self.predictor, self.rule, keep_first=at_work, aging=self._aging)

    def promise(self, here: Pose) -> dict[str, float]:
        """Return `eta`, `step_eta` and `eta_margin` of the first task, which has to be there [s].

        Empty if there is no path to it.
        """
        entry = self._entries[0]
        eta = self.predictor.effort(entry.task, entry.step, here).duration
        step_eta = self.predictor.effort(entry.task, entry.step, here, steps=1).duration
        if not isfinite(eta):
            return {}
        margin = self.experience.most_time(eta) - eta
        return {"eta": eta, "step_eta": step_eta, "eta_margin": margin}

    def ahead(self, here: Pose) -> list[Effort]:
        """Return, for each task, what the robot has done from here when the task is done."""
        return list(self.route(here, at_work=False).before[1:])

    def _change(self, task_id: str, **changes: object) -> None:
        self._entries = [
            replace(entry, **changes) if entry.task.id == task_id else entry  # type: ignore[arg-type]  # fields by name
            for entry in self._entries
        ]
