# SPDX-License-Identifier: BSD-3-Clause
"""The task list as operators' programs read it, and the robot beside each member."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from blackboard.domain.talker import SYNC

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.consensus.member import Member
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.talker import Talker, Timer


@dataclass(frozen=True)
class TaskList:
    """The task list, as far as it is committed (message BbSynch).

    Attributes:
        epoch: Of the blackboard that wrote it.
        version: Grows with every change.
        records: Every task the hive knows, in the order they were posted.
        hive: Id of the hive.
    """

    epoch: int
    version: int
    records: tuple[TaskRecord, ...] = ()
    hive: str = ""

    @cached_property
    def by_id(self) -> Mapping[str, TaskRecord]:
        """The records by the ids of their tasks."""
        return {record.task.id: record for record in self.records}

    def is_before(self, other: TaskList) -> bool:
        """Return whether another list of the same hive is newer."""
        mine, theirs = (self.epoch, self.version), (other.epoch, other.version)
        return self.hive == other.hive and mine < theirs


def committed_list(member: Member) -> TaskList:
    """Return the list that a member holds, as far as it knows that it stays for ever."""
    log = member.log
    records = tuple(log.stable.records.values())
    return TaskList(member.epoch, log.committed, records, member.hive)


class Sync:
    """Tells a member's list: to everyone while it is the active one, to its own robot always.

    Args:
        talker: How it speaks.
        period: A change is told this long after it at the latest, with all others till then [s].
        member: Gives the member's state.
        serves: Says whether the member tells everyone.
    """

    def __init__(
        self,
        talker: Talker,
        period: float,
        member: Callable[[], Member],
        serves: Callable[[], bool],
    ) -> None:
        self._talker = talker
        self._member = member
        self._serves = serves
        self._hear: Callable[[TaskList], None] | None = None
        self._telling = _Gathering(talker, period, self.publish)
        self._showing = _Gathering(talker, period, self._show)

    def tell(self) -> None:
        """Have the list told to everyone within the period."""
        self._telling.begin()

    def publish(self) -> None:
        """Tell everyone the list now."""
        if self._serves():
            self._talker.publish(SYNC, committed_list(self._member()))

    def follow(self, hear: Callable[[TaskList], None]) -> None:
        """Have the robot beside the member told the list whenever it is shown."""
        self._hear = hear

    def show(self) -> None:
        """Have the list told to the robot beside the member within the period."""
        if self._hear is not None:
            self._showing.begin()

    def _show(self) -> None:
        if self._hear is not None:
            self._hear(committed_list(self._member()))


class _Gathering:
    """Has one thing done for all that asked for it within a while."""

    def __init__(self, talker: Talker, period: float, action: Callable[[], None]) -> None:
        self._talker = talker
        self._period = period
        self._action = action
        self._due: Timer | None = None

    def begin(self) -> None:
        """Have it done once the period is over, with what asks for it till then."""
        if self._due is None:
            self._due = self._talker.after(self._period, self._end)

    def _end(self) -> None:
        self._due = None
        self._action()
