# SPDX-License-Identifier: BSD-3-Clause
"""A task and a robot as a desk shows them, and what of them changed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from fleet_manager.desk.events import Event


@dataclass(frozen=True, slots=True)
class TaskRow:
    """A task as a desk shows it.

    Attributes:
        record: What was posted and where it stands.
        due: When it is predicted to be done [s, hive's time]; None where unknown.
        stamp: When this was written [s, hive's time].
    """

    record: TaskRecord
    due: float | None = None
    stamp: float = 0.0

    @property
    def is_open(self) -> bool:
        """Whether it can still change."""
        return not self.record.state.is_terminal

    @property
    def progress(self) -> float:
        """Share of its steps that are done, 0 to 1."""
        if self.record.state is TaskState.DONE:
            return 1.0
        return min(1.0, self.record.step / max(1, self.record.steps))


@dataclass(frozen=True, slots=True)
class RobotRow:
    """A robot as a desk shows it.

    Attributes:
        status: Its last report.
        heard: When that came [s, wall].
        is_silent: Whether it should have reported since.
    """

    status: RobotStatus
    heard: float
    is_silent: bool = False

    @property
    def state(self) -> RobotState:
        """How it is; OFFLINE when it is silent."""
        return RobotState.OFFLINE if self.is_silent else self.status.state


@dataclass(slots=True)
class Changes:
    """What happened since the last look.

    Attributes:
        tasks: Ids of tasks that came, changed or went.
        robots: Names of robots that came, changed or went silent.
        events: For the log, oldest first.
    """

    tasks: set[str] = field(default_factory=set)
    robots: set[str] = field(default_factory=set)
    events: list[Event] = field(default_factory=list)


def due(record: TaskRecord, stamp: float) -> float | None:
    """Return when a task is predicted to be done [s]; None where nobody says."""
    return stamp + record.eta if record.eta > 0 and not record.state.is_terminal else None
