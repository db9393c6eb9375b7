# SPDX-License-Identifier: BSD-3-Clause
"""What an operator asks for, and how a robot goes about it (the report's Task).

A `Task` is exactly what was posted and may hold anything. `analyze_task` checks whether the hive
can accept it, and only what passes becomes a `TaskRecord` (see `record`). `split_task` turns it
into the `TaskStep`s that a controller executes one after the other.

`TRANSITIONS` is total: every state answers every event, with the next state or with None for "no
change". So the table decides about messages that come late, twice or out of order, not whoever
happens to handle them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum
from functools import lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.errors import TaskRefusedError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.domain.path_lengths import PathLengths
    from hive_common.pose import Pose

MAX_PRIORITY = 10
MAX_ID_LENGTH = 64
MAX_GOALS = 100
MAX_PAYLOAD = 1e6
"""Heaviest load of a task [kg]."""

MAX_POSTED = 2**32 - 1
"""Latest time at which a task may be posted [s]; ROS's stamps reach no further."""

_TASKS_SPLIT = 4096
"""Tasks whose steps are cached; everybody asks for them again and again."""


class TaskType(IntEnum):
    """What a robot does at which goals."""

    GA = 0  # go to A
    GAB = 1  # go to A, then to B (then to C ...)
    GPA = 2  # go to A and pick there
    GPAB = 3  # pick at A, pass the goals between, and put down at the last goal

    @property
    def picks(self) -> bool:
        """Whether it needs an arm."""
        return self in {TaskType.GPA, TaskType.GPAB}

    @property
    def goals_needed(self) -> int:
        """The minimum number of goals."""
        return 2 if self in {TaskType.GAB, TaskType.GPAB} else 1


class TaskState(IntEnum):
    """Where a task stands. DONE and what follows are terminal."""

    WAITING = 0  # on the task list, without a robot
    ASSIGNED = 1  # on a robot's schedule, not begun
    STARTED = 2  # being done
    DONE = 3  # done (terminal)
    REJECTED = 4  # never entered the task list (terminal)
    CANCELLED = 5  # cancelled by an operator (terminal)
    FAILED = 6  # will not be done; a person has to look (terminal)

    @property
    def is_terminal(self) -> bool:
        """Whether nothing can change it any more."""
        return self >= TaskState.DONE


class TaskEvent(Enum):
    """What can happen to a task on the task list."""

    ASSIGN = "assign"  # the leader gives it to a robot
    START = "start"  # its robot begins, or goes on to another step
    FINISH = "finish"  # its robot has done the last step
    RELEASE = "release"  # its robot no longer has it: handed back, or taken back
    FAIL = "fail"  # it cannot be done any more
    CANCEL = "cancel"  # an operator cancels it


_UNFINISHED = {TaskEvent.FINISH: TaskState.DONE, TaskEvent.FAIL: TaskState.FAILED}
_UNFINISHED |= {TaskEvent.CANCEL: TaskState.CANCELLED}
_HELD = {TaskEvent.START: TaskState.STARTED, TaskEvent.RELEASE: TaskState.WAITING} | _UNFINISHED
_TERMINAL = dict.fromkeys(TaskEvent)

TRANSITIONS: Mapping[TaskState, Mapping[TaskEvent, TaskState | None]] = MappingProxyType(
    {
        TaskState.WAITING: {
            TaskEvent.ASSIGN: TaskState.ASSIGNED,
            TaskEvent.START: None,
            TaskEvent.RELEASE: None,
            **_UNFINISHED,  # a robot may finish before it hears that it is to stop
        },
        TaskState.ASSIGNED: {TaskEvent.ASSIGN: None, **_HELD},
        TaskState.STARTED: {TaskEvent.ASSIGN: None, **_HELD},
        TaskState.DONE: _TERMINAL,
        TaskState.REJECTED: _TERMINAL,
        TaskState.CANCELLED: _TERMINAL,
        TaskState.FAILED: _TERMINAL,
    }
)
"""The next state for every state and event; None where the event changes nothing."""


class StepKind(IntEnum):
    """What one step asks of a robot."""

    MOVE = 0  # drive to the goal
    PICK = 1  # take the load on board where the robot stands
    PLACE = 2  # put the load down where the robot stands


_SAME_STAMP = 1e-3
"""Stamps lose digits on their way. The hive forgets a task long before another one with its id is
posted [s]."""


@dataclass(frozen=True, slots=True)
class Task:
    """A task as it was posted."""

    id: str  # unique name, 1 to 64 printable characters without spaces
    type: int  # one of `TaskType`
    goals: tuple[Pose, ...]  # A, B, C ... in `frame`.
    priority: int = 0  # 0 to 10, where 10 is the highest
    payload: float = 0.0  # what is to be carried [kg], at least 0
    frame: str = ""  # frame of the goals; empty means the map frame
    posted: float = 0.0  # when it was posted [s]; not part of the request
    # Who posted it, where another may choose the same id at the same moment; else empty.
    poster: str = ""
    no_split: bool = False  # whether it waits rather than being split into parts

    def asks_the_same_as(self, other: Task) -> bool:
        """Return whether both request the same; `posted` does not matter."""
        return self._content() == other._content()

    def was_posted_at(self, posted: float) -> bool:
        """Return whether a time is that at which it was posted [s]; 0 stands for an unknown one.

        It tells a task from a later one with the same id.
        """
        return _is_one_stamp(posted, self.posted)

    def _content(self) -> tuple[object, ...]:
        way = (self.type, self.goals, self.frame or "map")
        return (self.id, self.poster, *way, self.priority, self.payload, self.no_split)


@dataclass(frozen=True, slots=True)
class TaskStep:
    """One thing to do."""

    kind: StepKind
    goal: Pose  # where [map frame]
    payload: float  # what the arm handles [kg]; 0 for a drive
    task_id: str  # the task it is a part of
    # Of an arm's step, as the robot asks for it; see `blackboard.robot.loads`.
    action: str = field(default="", compare=False)  # its id, the same whenever it is asked for
    look: bool = field(default=False, compare=False)  # look first what is on board
    posted: float = field(default=0.0, compare=False)  # when that task was posted [s], if known

    def handles_the_load_of(self, other: TaskStep) -> bool:
        """Return whether two steps of arms are about one load.

        A later task with the same id has a load of its own.
        """
        return self.task_id == other.task_id and _is_one_stamp(self.posted, other.posted)


def _is_one_stamp(posted: float, other: float) -> bool:
    """Return whether two tasks with the same id were posted at one time; 0 may be any time."""
    return not (posted and other) or abs(posted - other) < _SAME_STAMP


def used_goals(task: Task) -> tuple[Pose, ...]:
    """Return the goals that the task's type visits: GA and GPA end at A, whatever follows."""
    return task.goals[:1] if TaskType(task.type).goals_needed == 1 else task.goals


def unused_goals(task: Task) -> str:
    """Say which goals the task's type does not visit; empty if it visits all."""
    unused = len(task.goals) - len(used_goals(task))
    name = TaskType(task.type).name
    return f"{name} goes to A only; the {unused} goals after it are not used" if unused else ""


def step_to_resume(task: Task, step: int) -> int:
    """Return where another robot continues after `step` steps with nothing on board.

    A visited goal stays visited, but a robot that is to pick has to drive there first.
    """
    return 0 if TaskType(task.type).picks else step


def step_to_go_on(task: Task, step: int) -> int:
    """Return where the robot that has done `step` steps continues after it was elsewhere.

    A robot that has not picked yet drives there again.
    """
    return step if is_picked(task, step) else step_to_resume(task, step)


@lru_cache(maxsize=_TASKS_SPLIT)
def split_task(task: Task) -> tuple[TaskStep, ...]:
    """Return the steps of a task that `analyze_task` has passed, in order."""
    kind = TaskType(task.type)
    goals = used_goals(task)
    steps = []
    for number, goal in enumerate(goals):
        steps.append(TaskStep(StepKind.MOVE, goal, 0.0, task.id))
        if kind.picks and number == 0:
            steps.append(_arm_step(StepKind.PICK, goal, task))
        elif kind is TaskType.GPAB and number == len(goals) - 1:
            steps.append(_arm_step(StepKind.PLACE, goal, task))
    return tuple(steps)


def _arm_step(kind: StepKind, goal: Pose, task: Task) -> TaskStep:
    return TaskStep(kind, goal, task.payload, task.id, posted=task.posted)


def is_picked(task: Task, step: int) -> bool:
    """Return whether the robot's arm has taken the load on board before a step."""
    return any(earlier.kind is StepKind.PICK for earlier in split_task(task)[:step])


def load_during(task: Task, step: int) -> float:
    """Return what is on board while a step is executed [kg].

    A person loads a GA or GAB before it starts; the robot's arm loads a GPA or GPAB. A person
    takes the load of a GPA off at A when it is done. `step` is an index into `split_task(task)`.
    """
    if not TaskType(task.type).picks:
        return task.payload
    return task.payload if is_picked(task, step) else 0.0


def analyze_task(task: Task, path_lengths: PathLengths | None = None) -> None:
    """Check that a posted task may enter the task list.

    Without `path_lengths`, goals are not checked for whether a robot can stand there.

    Raises:
        TaskRefusedError: Something is not allowed; the text says what is.
    """
    check_id(task.id)
    kinds = {kind.value: kind for kind in TaskType}
    if task.type not in kinds:
        allowed = ", ".join(f"{kind.name}={kind.value}" for kind in TaskType)
        raise TaskRefusedError(f"type {task.type} is unknown; allowed: {allowed}")
    if not 0 <= task.priority <= MAX_PRIORITY:
        raise TaskRefusedError(
            f"priority {task.priority} is not from 0 to {MAX_PRIORITY}, which is the highest"
        )
    if not 0 <= task.payload <= MAX_PAYLOAD:
        raise TaskRefusedError(
            f"payload {task.payload:g} kg is not a number from 0 to {MAX_PAYLOAD:g} kg"
        )
    if task.frame not in {"", "map"}:
        raise TaskRefusedError(f"frame {task.frame[:MAX_ID_LENGTH]!r} is unknown; allowed: map")
    if len(task.poster) > MAX_ID_LENGTH:
        raise TaskRefusedError(
            f"poster has {len(task.poster)} characters; allowed: at most {MAX_ID_LENGTH}"
        )
    if not 0 <= task.posted <= MAX_POSTED:
        raise TaskRefusedError(
            f"posted at {task.posted:.0f} s; allowed: 0 to {MAX_POSTED} s, where 0 says nothing"
        )
    _check_goals(task, kinds[task.type], path_lengths)


def check_id(task_id: str) -> None:
    """Check the id of a task.

    Raises:
        TaskRefusedError: It is empty, too long, or has characters that are not allowed.
    """
    if not 1 <= len(task_id) <= MAX_ID_LENGTH:
        raise TaskRefusedError(f"id has {len(task_id)} characters; allowed: 1 to {MAX_ID_LENGTH}")
    if not task_id.isprintable() or " " in task_id:
        raise TaskRefusedError(f"id {task_id!r} has spaces or control characters; leave them out")


def _check_goals(task: Task, kind: TaskType, path_lengths: PathLengths | None) -> None:
    if not kind.goals_needed <= len(task.goals) <= MAX_GOALS:
        raise TaskRefusedError(
            f"{kind.name} has {len(task.goals)} goals; allowed: {kind.goals_needed} to {MAX_GOALS}"
        )
    for number, goal in enumerate(task.goals):
        name = goal_name(number)
        if goal.flaw:
            raise TaskRefusedError(
                f"goal {name} ({goal.x:g}, {goal.y:g}, {goal.yaw:g}) {goal.flaw}"
            )
        if path_lengths is not None and (refusal := path_lengths.refusal(goal)):
            raise TaskRefusedError(f"goal {name} {goal} {refusal}")


def goal_name(number: int) -> str:
    """Return a goal's name for operators: A, B, ... Z, then 27, 28, ..."""
    return chr(ord("A") + number) if number < 26 else str(number + 1)  # noqa: PLR2004 (letters)
