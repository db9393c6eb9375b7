# SPDX-License-Identifier: BSD-3-Clause
"""What the bodies of a fleet have really done, whatever anybody reports."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain import task as domain
from blackboard.domain.task import split_task

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.task import Task, TaskStep


class Ledger:
    """Follows some tasks.

    Attributes:
        posted: When each was posted, by its id [s].
        done: When its last step was done, once for each time [s].
    """

    def __init__(self, tasks: Iterable[Task]) -> None:
        self._tasks = {task.id: task for task in tasks}
        self._parts: dict[str, Task] = {}
        self.posted: dict[str, float] = {}
        self.done: dict[str, list[float]] = {}

    def learn_parts(self, parts: Iterable[Task]) -> None:
        """Follow tasks too into which others were split."""
        self._parts |= {part.id: part for part in parts}

    def load_during(self, step: TaskStep) -> float:
        """Return what is on board while a step is done [kg]; nothing, if it is of no task."""
        task = self._known(step)
        steps = split_task(task) if task is not None else []
        return domain.load_during(task, steps.index(step)) if task and step in steps else 0.0

    def note(self, step: TaskStep, now: float) -> None:
        """Note that a body has done a step."""
        task = self._known(step)
        if task is not None and step == split_task(task)[-1]:
            self.done.setdefault(step.task_id, []).append(now)

    @property
    def is_all_done(self) -> bool:
        """Whether every task has been done."""
        return self.done.keys() >= self._tasks.keys()

    @property
    def done_twice(self) -> int:
        """How many tasks have been done more than once."""
        return sum(len(times) > 1 for times in self.done.values())

    @property
    def times_to_done(self) -> list[float]:
        """From posting until done for the first time, of each task that is done [s]."""
        return [times[0] - self.posted[task_id] for task_id, times in self.done.items()]

    def _known(self, step: TaskStep) -> Task | None:
        return self._tasks.get(step.task_id) or self._parts.get(step.task_id)
