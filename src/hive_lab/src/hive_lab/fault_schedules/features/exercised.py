# SPDX-License-Identifier: BSD-3-Clause
"""Counts what a schedule makes a hive do, so that nobody has to believe that it is tested."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from blackboard.consensus.messages import AppendEntries
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import Order, OrderKind, TaskUpdate
from blackboard.domain.settings import COST_MODEL_NAMES, DECISIONS
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.consensus.journal import HardState
    from blackboard.consensus.member import Member
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.settings import BlackboardSettings
    from hive_lab.fault_schedules.features.kit import RobotKit

_ORDERS = {kind: f"order {kind.name}" for kind in OrderKind}
_LOST = {
    "reassign": "lost robot: its task is reassigned",
    "wait": "lost robot: its task waits for it",
    "operator": "lost robot: its task is left to a person",
}
_ON_BOARD = "lost robot: its load may be on board"
_NOT_COMMITTED = "takeover with a change that was not committed"
_NOT_TOLD = "takeover with a committed change that nobody was told of"
_DROPPED = "takeover that drops a change"
_QUIET = "takeover between two changes"

FEATURES = (
    *_ORDERS.values(),
    *_LOST.values(),
    *(f"decision {name}" for name in DECISIONS),
    *(f"cost model {name}" for name in COST_MODEL_NAMES),
    _ON_BOARD,
    "preemption",
    "split",
    "learners",
    "charging",
    "compaction",
    "membership change",
    "task posted anew",
    _NOT_COMMITTED,
    _NOT_TOLD,
    _DROPPED,
    _QUIET,
)
"""Everything that is counted in schedules of any scenario."""

UNDONE = "split undone"
"""Counted as well; it happens where a strong robot comes and goes, and hardly anywhere else."""


class Exercised:
    """Counts what one run does.

    Attributes:
        counts: How often each of `FEATURES` and `UNDONE` happened.
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()

    def drawn(self, board: BlackboardSettings, kits: Iterable[RobotKit], learners: int) -> None:
        """Count what a hive is set up with; `learners` is the number of robots without a vote."""
        self.counts[f"decision {board.decision}"] += 1
        self.counts["learners"] += learners
        for kit in kits:
            self.counts[f"cost model {kit.settings.cost_model}"] += 1

    def said(self, message: object) -> None:
        """Count what a member or robot sends."""
        if isinstance(message, Order):
            self.counts[_ORDERS[message.kind]] += 1
        elif isinstance(message, TaskUpdate):
            self.counts["preemption"] += bool(message.put_off_for)
        elif isinstance(message, RobotStatus):
            self.counts["charging"] += message.state is RobotState.CHARGING
        elif isinstance(message, AppendEntries):
            self.counts["compaction"] += message.snapshot is not None

    def committed(self, before: TaskRecord | None, after: TaskRecord, *, anew: bool) -> None:
        """Count a committed change of a task; `anew` if it has the id of a forgotten one."""
        self.counts["task posted anew"] += anew
        if before is None:
            return
        self.counts["split"] += bool(after.parts and not before.parts)
        self.counts[UNDONE] += bool(before.parts and not after.parts)
        if before.is_held:
            self._count_loss(after)

    def _count_loss(self, after: TaskRecord) -> None:
        """Count what becomes of the task of a lost robot, which only the reason tells."""
        waits = after.is_held and after.reason.startswith("waits for ")
        self.counts[_LOST["wait"]] += waits
        if " is lost, " not in after.reason:
            return
        if after.state is TaskState.WAITING:
            self.counts[_LOST["reassign"]] += 1
        elif after.state is TaskState.FAILED:
            on_board = "may be on board" in after.reason
            self.counts[_ON_BOARD if on_board else _LOST["operator"]] += 1

    def took_over(self, member: Member, committed: int, disks: Iterable[HardState | None]) -> None:
        """Count at which step of a commit a member becomes leader.

        Args:
            member: The new leader.
            committed: Version of the last change that any member has committed.
            disks: What every member has on disk.
        """
        log = member.log
        earlier = (entry.version for entry in reversed(log.entries) if entry.epoch < member.epoch)
        found = next(earlier, log.base.position.version)
        epochs = [disk.log.position for disk in disks if disk is not None]
        last = max((each.version for each in epochs if each.epoch < member.epoch), default=0)
        if found > committed:
            self.counts[_NOT_COMMITTED] += 1
        elif last > found:
            self.counts[_DROPPED] += 1
        elif log.committed < committed:
            self.counts[_NOT_TOLD] += 1
        else:
            self.counts[_QUIET] += 1

    def changed_members(self) -> None:
        """Count a committed change of the list of members."""
        self.counts["membership change"] += 1
