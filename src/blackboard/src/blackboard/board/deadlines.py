# SPDX-License-Identifier: BSD-3-Clause
"""By when a robot has promised to get on with a task, and whether it is too late by now.

With every report a robot says how long the rest of the task is going to take, and how long the
next step. The promise lasts a multiple of that and a grace; the next report renews it. Of a task
of high priority every step has to be in time. A task that waits in a robot's list is promised anew
whenever its robot gets on with another one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.record import TaskRecord

STEPWISE_FROM = 8
"""The least priority of which every single step is promised."""


@dataclass(frozen=True, slots=True)
class _Deadline:
    progress: object
    deadline: float
    allowed: float


class Deadlines:
    """Remembers when each task was last heard to get on.

    Args:
        factor: How many times the promised time a robot may take.
        grace: What it may take beyond that [s].
    """

    def __init__(self, factor: float, grace: float) -> None:
        self._factor = factor
        self._grace = grace
        self._deadlines: dict[str, _Deadline] = {}

    def overdue(self, held: Iterable[TaskRecord], now: float) -> list[tuple[TaskRecord, float]]:
        """Return the records whose robots are too late, each with the time that it had [s].

        Args:
            held: All records that a robot has now; those of other tasks are forgotten.
            now: The time [s].
        """
        records = tuple(held)
        at_work = {
            record.robot: (record.task.id, record.step)
            for record in records
            if record.state is TaskState.STARTED
        }
        deadlines = {}
        late = []
        for record in records:
            progress = (record.assignment, record.state, record.step, at_work.get(record.robot))
            promise = self._deadlines.get(record.task.id)
            if promise is None or promise.progress != progress:
                allowed = self._allowed(record)
                promise = _Deadline(progress, now + allowed, allowed)
            deadlines[record.task.id] = promise
            if now > promise.deadline:
                late.append((record, promise.allowed))
        self._deadlines = deadlines
        return late

    def _allowed(self, record: TaskRecord) -> float:
        stepwise = record.task.priority >= STEPWISE_FROM and record.state is TaskState.STARTED
        promised = (record.step_eta if stepwise else 0.0) or record.eta
        # A robot that cannot predict, or another maker's that does not, promises nothing.
        return self._factor * promised + self._grace if promised else float("inf")
