# SPDX-License-Identifier: BSD-3-Clause
"""The list that every member of the hive holds: whole up to some point, and the changes after it.

This is the log of Raft (Ongaro and Ousterhout, 2014), kept short: what is committed is folded into
the whole list sooner or later, so nobody keeps the hive's history. All of it are values and
functions of values; `member` says when they are used.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.domain.record import TaskRecord


class Position(NamedTuple):
    """How far a list goes; the greater of two is the newer, as Raft compares them.

    Attributes:
        epoch: Of the active blackboard that wrote the last change.
        version: Number of the last change; grows by one with every change.
    """

    epoch: int = 0
    version: int = 0


@dataclass(frozen=True, slots=True)
class Entry:
    """One change of the list.

    Attributes:
        epoch: Of the active blackboard that wrote it.
        version: Its number.
        records: The records that are new or changed.
        members: The members from here on, in the order in which they joined; None where they stay
            as they are.
        forgotten: Ids of tasks that the list does without from here on; all of them have ended.
    """

    epoch: int
    version: int
    records: tuple[TaskRecord, ...] = ()
    members: tuple[str, ...] | None = None
    forgotten: tuple[str, ...] = ()

    @property
    def position(self) -> Position:
        """How far a list goes that ends with this change."""
        return Position(self.epoch, self.version)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All that the hive knows at one position.

    Attributes:
        position: How far it goes.
        records: Every task by id, in the order they were posted, but for those forgotten.
        members: Ids of the members whose votes count, in the order in which they joined.
        earlier: The highest number of an assignment of any task that was forgotten. A task that
            is posted anew counts on from there, so that no number of an id comes twice.
    """

    position: Position = field(default_factory=Position)
    records: Mapping[str, TaskRecord] = field(default_factory=lambda: MappingProxyType({}))
    members: tuple[str, ...] = ()
    earlier: int = 0

    def after(self, entries: Iterable[Entry]) -> Snapshot:
        """Return what it becomes with some changes, which have to follow it without a gap."""
        position, members, earlier = self.position, self.members, self.earlier
        records: dict[str, TaskRecord] | None = None
        for entry in entries:
            position = entry.position
            members = members if entry.members is None else entry.members
            if records is None and (entry.records or entry.forgotten):
                records = dict(self.records)
            if records is None:
                continue
            for task_id in entry.forgotten:
                if (gone := records.pop(task_id, None)) is not None:
                    earlier = max(earlier, gone.assignment)
            for record in entry.records:
                records[record.task.id] = record
        return Snapshot(position, self.records if records is None else records, members, earlier)


@dataclass(frozen=True, slots=True)
class Log:
    """What one member holds.

    Attributes:
        base: The list up to some committed position.
        entries: The changes after it, without a gap.
        committed: Version of the last change of which this member knows that it stays for ever.
        latest: The list with all changes, committed or not.
    """

    base: Snapshot
    entries: tuple[Entry, ...]
    committed: int
    latest: Snapshot

    @classmethod
    def of(
        cls, base: Snapshot, entries: tuple[Entry, ...] = (), committed: int | None = None
    ) -> Log:
        """Make one of its parts; without a version, only the base is committed."""
        known = base.position.version if committed is None else committed
        return cls(base, entries, known, base.after(entries))

    @property
    def position(self) -> Position:
        """How far it goes."""
        return self.latest.position

    @property
    def stable(self) -> Snapshot:
        """The list as far as it is committed."""
        if self.committed == self.latest.position.version:
            return self.latest
        return self.base.after(self.entries[: self.committed - self.base.position.version])

    @property
    def members_are_settled(self) -> bool:
        """Whether no change of the members waits to be committed."""
        waiting = self.entries[self.committed - self.base.position.version :]
        return all(entry.members is None for entry in waiting)

    def at(self, version: int) -> Position | None:
        """Return the position at a version, or None where this log does not reach there."""
        index = version - self.base.position.version
        if index == 0:
            return self.base.position
        return self.entries[index - 1].position if 0 < index <= len(self.entries) else None

    def since(self, version: int) -> tuple[Entry, ...] | None:
        """Return the changes after a version, or None where they have been folded already."""
        index = version - self.base.position.version
        return self.entries[index:] if index >= 0 else None

    def append(self, entry: Entry) -> Log:
        """Add one more change, which may not be committed yet."""
        return replace(self, entries=(*self.entries, entry), latest=self.latest.after([entry]))

    def commit(self, version: int, kept: int) -> Log:
        """Note that all up to a version stays; what has been committed before stays in any case.

        Args:
            version: Up to which.
            kept: How many committed changes are kept for members that missed some.
        """
        if version <= self.committed:
            return self
        log = replace(self, committed=version)
        return log.fold() if version - self.base.position.version > kept else log

    def fold(self) -> Log:
        """Forget the older half of the committed changes as such; the whole list has them."""
        half = (self.committed - self.base.position.version + 1) // 2
        base = self.base.after(self.entries[:half])
        return Log(base, self.entries[half:], self.committed, self.latest)


def committed_version(log: Log, epoch: int, held: Iterable[int], majority: int) -> int:
    """Return up to which version a log is committed.

    A change of an earlier epoch counts only once one of the present epoch follows it, however many
    hold it (section 5.4.2 of the Raft paper): until then another could still overwrite it.

    Args:
        log: Of the active blackboard.
        epoch: Of the active blackboard.
        held: For every member, its own included, the version it has on disk.
        majority: How many members are needed.
    """
    version = sorted(held, reverse=True)[majority - 1]
    position = log.at(version) if version > log.committed else None
    if position is None or position.epoch != epoch:
        return log.committed
    return version
