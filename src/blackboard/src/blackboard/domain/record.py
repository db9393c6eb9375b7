# SPDX-License-Identifier: BSD-3-Clause
"""The record of a task on the list, and the messages about tasks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.domain.task import TRANSITIONS, TaskState, split_task

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.domain.task import Task, TaskEvent


MOVES_ON = "it goes to another robot"
"""Ends the reason of a task that its robot has handed back because a plan gives it to another."""

TOLD_TO = "was told to hand it back"
"""Ends what the robot says of such a task; of one that is overdue the leader says more."""

MAX_TEXT = 10_000
"""Characters of a reason, which may mention each of a hundred robots."""

ANY_ASSIGNMENT = 2**32 - 1
"""Above any assignment number: of a task that is not on the list, or of another hive."""


@dataclass(frozen=True, slots=True)
class TaskRecord:
    """A task on the list and its progress."""

    task: Task  # as posted, or a part of it
    state: TaskState = TaskState.WAITING
    robot: str = ""  # the robot that has it, or had it when it ended; empty if none
    step: int = 0  # steps done so far
    eta: float = 0.0  # predicted time from the last report until it is done [s]; 0 if unknown
    reason: str = ""  # for a person; may be empty
    parent: str = ""  # id of the task of which it is a part; empty if it is whole
    # Number of its last assignment, starting after `earlier`. It tells to which assignment a
    # report belongs.
    assignment: int = 0
    tried: tuple[str, ...] = ()  # the robots that failed it, one entry for each time
    # Predicted time from the last report until the present step is done [s]; 0 if unknown.
    step_eta: float = 0.0
    # Into how many parts it was split, each with a record of its own; 0 if it is whole.
    parts: int = 0
    # Assignments up to this number belong to tasks that the hive has forgotten. Reports on them do
    # not concern this task, even if it has the same id.
    earlier: int = 0
    # When `eta` was predicted, on the clock of `Task.posted` [s]; 0 if unknown.
    predicted_at: float = 0.0
    started: float = 0.0  # when it was first begun, on that clock [s]; 0 if it was not
    ended: float = 0.0  # when it ended, on that clock [s]; 0 if it has not
    division: str = ""  # into what it was split and why, in words; empty if it is whole
    # How much longer than `eta` one such task in ten takes [s]; 0 if unknown.
    eta_margin: float = 0.0

    @classmethod
    def new(cls, task: Task, earlier: int, reason: str = "", parent: str = "") -> TaskRecord:
        """Return the record of a task that enters the list; see the attributes of the class."""
        return cls(task, reason=reason, parent=parent, assignment=earlier, earlier=earlier)

    @property
    def times_assigned(self) -> int:
        """How often it has been assigned."""
        return self.assignment - self.earlier

    @property
    def steps(self) -> int:
        """The number of steps of the task, or of its parts if it was split."""
        return self.parts or len(split_task(self.task))

    @property
    def is_held(self) -> bool:
        """Whether a robot has it."""
        held = self.state in {TaskState.ASSIGNED, TaskState.STARTED}
        return held and not self.parts

    def has_ended(self, robot_id: str, assignment: int) -> bool:
        """Return whether a robot no longer has the task that an assignment gave it.

        False if the record is older than the assignment and does not know of it yet.
        """
        elsewhere = self.state.is_terminal or self.robot != robot_id
        return self.assignment > assignment or (self.assignment == assignment and elsewhere)

    def is_once_held(self, assignment: int) -> bool:
        """Return whether an assignment is the present or an earlier one of this very task.

        An assignment by a hive that has joined this one counts once this hive has assigned it too.
        """
        of_another_hive = assignment == ANY_ASSIGNMENT and self.times_assigned > 0
        return of_another_hive or self.earlier < assignment <= self.assignment

    def gets_on(self, update: TaskUpdate) -> bool:
        """Return whether a robot's report of a start is news, not late or a repetition."""
        return self.state is TaskState.ASSIGNED or update.step > self.step

    def dated(self, now: float) -> TaskRecord:
        """Return the record with the time of its start and end, where these are news.

        `now` is the time on the clock of `Task.posted` [s].
        """
        if self.state is TaskState.STARTED and not self.started:
            return replace(self, started=now)
        if self.state.is_terminal and not self.ended:
            return replace(self, ended=now)
        return self

    @property
    def is_moved(self) -> bool:
        """Whether it waits only for the robot to which a plan gives it."""
        return self.state is TaskState.WAITING and self.reason.endswith((MOVES_ON, TOLD_TO))

    def reported(self, event: TaskEvent, update: TaskUpdate, at: float) -> TaskRecord | None:
        """Return the record after a robot's report, or None if nothing changes.

        `at` is when the report came, on the clock of `Task.posted` [s].
        """
        return self.after(
            event,
            robot=update.robot_id,
            step=min(update.step, self.steps),
            eta=update.eta,
            step_eta=update.step_eta,
            eta_margin=update.eta_margin,
            predicted_at=at,
            reason=update.reason,
        )

    def told(self, epoch: int) -> TaskUpdate:
        """Return the update that the blackboard of an epoch publishes."""
        return TaskUpdate(
            task_id=self.task.id,
            state=self.state,
            robot_id=self.robot,
            step=self.step,
            steps=self.steps,
            eta=self.eta,
            epoch=epoch,
            # It may quote several robots, each of which may say as much.
            reason=self.reason[:MAX_TEXT],
            assignment=self.assignment,
            step_eta=self.step_eta,
            eta_margin=self.eta_margin,
        )

    def after(self, event: TaskEvent, **changes: object) -> TaskRecord | None:
        """Return the record after an event and its changes, or None if it has no effect."""
        state = TRANSITIONS[self.state][event]
        return None if state is None else replace(self, state=state, **changes)  # type: ignore[arg-type]  # fields by name


@dataclass(frozen=True, slots=True)
class TaskUpdate:
    """A change of a task's state, published or reported (message TaskState)."""

    task_id: str
    state: TaskState
    # The robot that has it; empty if none. A robot that hands a task back reports WAITING with its
    # own id.
    robot_id: str = ""
    step: int = 0  # steps done so far
    steps: int = 0
    eta: float = 0.0  # predicted time until it is done [s]; 0 if unknown
    epoch: int = 0  # of the blackboard that decided, or that the robot obeys
    reason: str = ""  # for a person; may be empty
    assignment: int = 0  # the assignment to which the update belongs
    step_eta: float = 0.0  # predicted time until the present step is done [s]; 0 if unknown
    # Id of the more urgent task for which a robot hands this one back; else empty.
    put_off_for: str = ""
    # How much longer than `eta` one such task in ten takes [s]; 0 if unknown.
    eta_margin: float = 0.0


@dataclass(frozen=True, slots=True)
class Broadcast:
    """A call for bids on all of some tasks (message TaskMsgArray)."""

    epoch: int  # of the blackboard
    auction: int  # number of the auction within the epoch; bids repeat it
    tasks: tuple[tuple[Task, int], ...]  # each with the first step still to do
    hive: str = ""  # id of the blackboard's hive
    round: int = 1  # of the auction, from 1 on; bids repeat it
    # The robots that are asked; None means all. Each comes with the task it has just been given,
    # which has to be on its list when it bids; empty if there is none.
    asked: Mapping[str, str] | None = None
    basis: bool = False  # whether robots answer with the basis of their bids instead of bids

    def asks(self, robot_id: str) -> bool:
        """Return whether a robot is asked."""
        return self.asked is None or robot_id in self.asked

    def given_to(self, robot_id: str) -> str:
        """Return the task that a robot must have received before it answers; empty if none."""
        return (self.asked or {}).get(robot_id, "")


class OrderKind(Enum):
    """What an order asks of a robot, with the value of TaskMsg's `order`."""

    ASSIGN = 0  # take the task into its list
    TAKE_BACK = 1  # drop the task
    HAND_BACK = 2  # drop the task and report how far it has come
    HAND_BACK_UNBEGUN = 3  # the same, but a robot that has begun keeps the task
    FORGOTTEN = 4  # drop the task and stop reporting on it: the hive has forgotten it

    @property
    def asks_report(self) -> bool:
        """Whether the robot reports how far it has come."""
        return self in {OrderKind.HAND_BACK, OrderKind.HAND_BACK_UNBEGUN}


@dataclass(frozen=True, slots=True)
class Order:
    """An order to one robot about one task (TaskMsg on task_assign)."""

    task: Task
    robot_id: str  # who is meant
    kind: OrderKind = OrderKind.ASSIGN  # what the robot does with the task
    step: int = 0  # the first step that is still to be done
    epoch: int = 0  # of the blackboard that decided
    assignment: int = 0  # number of this assignment of the task
    # The last `RobotStatus.sent` that the blackboard has heard from the robot [s].
    heard: float = 0.0
    hive: str = ""  # id of the blackboard's hive
    place: int = 0  # where it goes in the robot's list, 1 is first; 0 if the robot decides


@dataclass(frozen=True, slots=True)
class Load:
    """A load that the robot's arm has begun to take."""

    task_id: str
    payload: float  # [kg]
    hive: str  # of the assignment for which it was begun
    assignment: int
    posted: float = 0.0  # when its task was posted [s]; 0 if that is not known

    @property
    def name(self) -> str:
        """The name of that assignment; the ids of the arm's actions begin with it."""
        return f"{self.hive}/{self.task_id}/{self.assignment}"

    def is_of(self, task: Task) -> bool:
        """Return whether it is the load of a task, and not of an earlier one of the same id."""
        return task.id == self.task_id and task.was_posted_at(self.posted)

    def is_known_to(self, record: TaskRecord, hive: str) -> bool:
        """Return whether a record of a hive is not from before that assignment."""
        return hive != self.hive or record.assignment >= self.assignment


@dataclass(frozen=True, slots=True)
class Hold:
    """What may be on board, as a robot writes it down."""

    loads: tuple[Load, ...] = ()
    sure: bool = False  # whether nothing else can be on board
