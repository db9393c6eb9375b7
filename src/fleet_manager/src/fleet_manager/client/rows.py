# SPDX-License-Identifier: BSD-3-Clause
"""A task and a robot as an operator sees them, and what changed."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from fleet_manager.client.words import Event


@dataclass(frozen=True, slots=True)
class TaskRow:
    """A task as an operator sees it."""

    record: TaskRecord  # the task and its state
    stamp: float = 0.0  # when the record was written [s, hive's time]; 0 where unknown

    @property
    def is_open(self) -> bool:
        """Whether the task can still change."""
        return not self.record.state.is_terminal

    @property
    def is_refused(self) -> bool:
        """Whether the blackboard rejected the task, so that it is not on the task list."""
        return self.record.state is TaskState.REJECTED

    @property
    def due(self) -> float | None:
        """When the task is predicted to be done [s, hive's time]; None where unknown."""
        record = self.record
        is_known = record.eta > 0 and record.predicted_at > 0 and self.is_open
        return record.predicted_at + record.eta if is_known else None

    @property
    def progress(self) -> float:
        """Share of the steps that are done, 0 to 1."""
        if self.record.state is TaskState.DONE:
            return 1.0
        return min(1.0, self.record.step / max(1, self.record.steps))


@dataclass(frozen=True, slots=True)
class RobotRow:
    """A robot as an operator sees it."""

    status: RobotStatus  # the robot's last report, or what the leader says of a silent one
    heard: float  # when the robot itself last reported [s, wall]
    is_silent: bool = False  # whether its next report is overdue here
    is_lost: bool = False  # whether the leader does not hear it
    waits: str = ""  # whom it waits for and where, in words; empty if it does not wait

    @property
    def reason(self) -> str:
        """Why it does not do what it might: by its report, else because it waits."""
        if self.is_lost and self.status.state is not RobotState.OFFLINE:
            return "heard here, but not by the leader"
        return self.status.reason or ("" if self.is_silent else self.waits)

    @property
    def has_load_left(self) -> bool:
        """Whether it is out of service with a load on board."""
        return self.state is RobotState.DEFECT and self.status.payload > 0

    @property
    def state(self) -> RobotState:
        """The reported state; OFFLINE while the robot is silent, here or to the leader."""
        is_offline = self.is_silent or self.is_lost
        return RobotState.OFFLINE if is_offline else self.status.state


@dataclass(slots=True)
class Changes:
    """What happened since the last look."""

    tasks: set[str] = field(default_factory=set)  # ids of those that came, changed or went
    robots: set[str] = field(default_factory=set)  # those that came, changed or went silent
    events: list[Event] = field(default_factory=list)  # in words, oldest first
