# SPDX-License-Identifier: BSD-3-Clause
"""The task list as operators' programs and robots read it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.talker import SYNC

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.record import TaskRecord
    from blackboard.talker import Talker, Timer


@dataclass(frozen=True, slots=True)
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

    def is_before(self, other: TaskList) -> bool:
        """Return whether another list of the same hive is newer."""
        mine, theirs = (self.epoch, self.version), (other.epoch, other.version)
        return self.hive == other.hive and mine < theirs


class Sync:
    """Tells the task list to everyone, changes within a while together.

    Args:
        talker: How it speaks.
        period: The list is told this long after a change at the latest [s].
        known: Gives the list; None where there is nothing to tell.
    """

    def __init__(
        self, talker: Talker, period: float, known: Callable[[], TaskList | None]
    ) -> None:
        self._talker = talker
        self._period = period
        self._known = known
        self._due: Timer | None = None

    def tell(self) -> None:
        """Have the list told within the period."""
        if self._due is None:
            self._due = self._talker.after(self._period, self.publish)

    def publish(self) -> None:
        """Tell the list now."""
        self._due = None
        known = self._known()
        if known is not None:
            self._talker.publish(SYNC, known)
