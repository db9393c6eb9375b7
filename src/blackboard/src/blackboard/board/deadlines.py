# SPDX-License-Identifier: BSD-3-Clause
"""When each task has to make progress, and which tasks are overdue.

With every report a robot predicts how long the rest of the task takes, and how long the present
step, each with a margin that nine of ten tasks keep. The deadline is a multiple of that plus a
grace; every report sets a new one. Of a task of
high priority each step has a deadline of its own. A task that waits in a robot's schedule gets a
new deadline whenever the robot makes progress with another one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.domain.record import TaskRecord

STEPWISE_FROM = 8
"""The least priority of which every single step has a deadline."""


@dataclass(frozen=True, slots=True)
class _Deadline:
    progress: object
    at: float
    allowed: float


class Deadlines:
    """Remembers when each task last made progress.

    Args:
        factor: How many times the predicted time a robot may take.
        grace: What it may take beyond that [s].
    """

    def __init__(self, factor: float, grace: float) -> None:
        self._factor = factor
        self._grace = grace
        self._deadlines: dict[str, _Deadline] = {}

    def overdue(self, held: Iterable[TaskRecord], now: float) -> list[tuple[TaskRecord, float]]:
        """Return the overdue records of all that are held now [s], with the time allowed [s]."""
        records = tuple(held)
        at_work = {
            record.robot: (record.task.id, record.step)
            for record in records
            if record.state is TaskState.STARTED
        }
        deadlines = {}
        overdue = []
        for record in records:
            progress = (record.assignment, record.state, record.step, at_work.get(record.robot))
            deadline = self._deadlines.get(record.task.id)
            if deadline is None or deadline.progress != progress:
                allowed = self._allowed(record)
                deadline = _Deadline(progress, now + allowed, allowed)
            deadlines[record.task.id] = deadline
            if now > deadline.at:
                overdue.append((record, deadline.allowed))
        self._deadlines = deadlines
        return overdue

    def _allowed(self, record: TaskRecord) -> float:
        stepwise = record.task.priority >= STEPWISE_FROM and record.state is TaskState.STARTED
        predicted = (record.step_eta if stepwise else 0.0) or record.eta
        # A robot that predicts nothing, as another maker's may, has no deadline.
        if predicted <= 0.0:
            return math.inf
        # The margin grows with the root of the time; see `Experience.most_time`.
        share = math.sqrt(predicted / record.eta) if record.eta > 0.0 else 1.0
        return self._factor * (predicted + share * max(0.0, record.eta_margin)) + self._grace
