# SPDX-License-Identifier: BSD-3-Clause
"""The committed task list, as operators' programs and the robots read it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.consensus.member import Member
    from blackboard.domain.charger import Grant
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.talker import Talker, Timer


@dataclass(frozen=True)
class TaskList:
    """The task list, as far as it is committed (message BbSynch)."""

    epoch: int  # of the blackboard that wrote it
    version: int  # grows with every change
    # Every task the hive knows, in the order they were posted.
    records: tuple[TaskRecord, ...] = ()
    hive: str = ""  # id of the hive
    earlier: int = 0  # the highest assignment number of any task that was forgotten
    grants: tuple[Grant, ...] = ()  # which robot has which charger

    @cached_property
    def by_id(self) -> Mapping[str, TaskRecord]:
        """The records by the ids of their tasks."""
        return {record.task.id: record for record in self.records}

    def is_before(self, other: TaskList) -> bool:
        """Return whether another list of the same hive is newer."""
        mine, theirs = (self.epoch, self.version), (other.epoch, other.version)
        return self.hive == other.hive and mine < theirs


def committed_list(member: Member) -> TaskList:
    """Return the task list as far as a member knows that it is committed."""
    log = member.log
    known = log.stable
    records = tuple(known.records.values())
    grants = tuple(known.grants.values())
    return TaskList(member.epoch, log.committed, records, member.hive, known.earlier, grants)


class Coalescer:
    """Runs an action once for all requests within a period [s] from the first one."""

    def __init__(self, talker: Talker, period: float, action: Callable[[], None]) -> None:
        self._talker = talker
        self._period = period
        self._action = action
        self._due: Timer | None = None

    def request(self) -> None:
        """Have the action run within the period."""
        if self._due is None:
            self._due = self._talker.after(self._period, self._run)

    def _run(self) -> None:
        self._due = None
        self._action()
