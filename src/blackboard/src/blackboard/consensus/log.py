# SPDX-License-Identifier: BSD-3-Clause
"""The replicated log: a snapshot, and the entries after it.

This is the log of Raft (Ongaro and Ousterhout, 2014). Committed entries are folded into the
snapshot after a while, so no member keeps the hive's whole history.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.domain.charger import Grant
    from blackboard.domain.record import TaskRecord


class Position(NamedTuple):
    """Of an entry in the log; Raft compares logs by the positions of their last entries."""

    epoch: int = 0  # of the leader that wrote the entry (Raft's term)
    version: int = 0  # number of the entry; grows by one with every entry (Raft's index)


@dataclass(frozen=True, slots=True)
class Entry:
    """One change of the task list or of the members."""

    epoch: int
    version: int
    records: tuple[TaskRecord, ...] = ()  # the new and changed ones
    # The members from here on, in the order in which they joined; None if unchanged.
    members: tuple[str, ...] | None = None
    forgotten: tuple[str, ...] = ()  # ids of tasks that leave the list; all of them have ended
    grants: tuple[Grant, ...] = ()  # of chargers, as far as they change

    @property
    def position(self) -> Position:
        """Position of the entry."""
        return Position(self.epoch, self.version)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All that the hive knows at one position."""

    position: Position = field(default_factory=Position)  # of the last entry in it
    # Every task that is not forgotten by id, in the order they were posted.
    records: Mapping[str, TaskRecord] = field(default_factory=lambda: MappingProxyType({}))
    # Ids of the members whose votes count, in the order in which they joined.
    members: tuple[str, ...] = ()
    # The highest assignment number of any task that was forgotten. New tasks count on from there,
    # so that no task id has the same number twice.
    earlier: int = 0
    # Which robot has which charger, by the charger's name.
    grants: Mapping[str, Grant] = field(default_factory=lambda: MappingProxyType({}))

    def after(self, entries: Iterable[Entry]) -> Snapshot:
        """Return the snapshot after the entries that follow it, without a gap."""
        position, members, earlier = self.position, self.members, self.earlier
        grants = self.grants
        records: dict[str, TaskRecord] | None = None
        for entry in entries:
            position = entry.position
            members = members if entry.members is None else entry.members
            if entry.grants:
                given = {**grants, **{each.charger: each for each in entry.grants}}
                grants = {name: each for name, each in given.items() if each.robot}
            if records is None and (entry.records or entry.forgotten):
                records = dict(self.records)
            if records is None:
                continue
            for task_id in entry.forgotten:
                if (gone := records.pop(task_id, None)) is not None:
                    earlier = max(earlier, gone.assignment)
            for record in entry.records:
                records[record.task.id] = record
        listed = self.records if records is None else records
        return Snapshot(position, listed, members, earlier, grants)


@dataclass(frozen=True, slots=True)
class Log:
    """The log of one member."""

    base: Snapshot  # the snapshot; all of it is committed
    entries: tuple[Entry, ...]  # those after it, without a gap
    committed: int  # version of the last entry that this member knows to be committed
    latest: Snapshot  # the state after all entries, committed or not

    @classmethod
    def of(
        cls, base: Snapshot, entries: tuple[Entry, ...] = (), committed: int | None = None
    ) -> Log:
        """Make a log of its parts; by default, only the snapshot is committed."""
        known = base.position.version if committed is None else committed
        return cls(base, entries, known, base.after(entries))

    @property
    def position(self) -> Position:
        """Position of the last entry."""
        return self.latest.position

    @property
    def stable(self) -> Snapshot:
        """The state after all committed entries."""
        if self.committed == self.latest.position.version:
            return self.latest
        return self.base.after(self.entries[: self.committed - self.base.position.version])

    @property
    def members_are_settled(self) -> bool:
        """Whether no change of the members waits to be committed."""
        waiting = self.entries[self.committed - self.base.position.version :]
        return all(entry.members is None for entry in waiting)

    def at(self, version: int) -> Position | None:
        """Return the position at a version, or None if the log does not contain it."""
        index = version - self.base.position.version
        if index == 0:
            return self.base.position
        return self.entries[index - 1].position if 0 < index <= len(self.entries) else None

    def since(self, version: int) -> tuple[Entry, ...] | None:
        """Return the entries after a version, or None if some are folded into the snapshot."""
        index = version - self.base.position.version
        return self.entries[index:] if index >= 0 else None

    def append(self, entry: Entry) -> Log:
        """Return the log with one more entry."""
        return replace(self, entries=(*self.entries, entry), latest=self.latest.after([entry]))

    def commit(self, version: int, kept: int) -> Log:
        """Return the log with all entries up to a version committed; committed ones stay so.

        If more than `kept` committed entries would remain, fold the older half into the snapshot.
        Members that are not further behind need no snapshot to catch up.
        """
        if version <= self.committed:
            return self
        behind = version - self.base.position.version
        if behind <= kept:
            return replace(self, committed=version)
        half = (behind + 1) // 2
        return Log(self.base.after(self.entries[:half]), self.entries[half:], version, self.latest)


def committed_version(log: Log, epoch: int, held: Iterable[int], majority: int) -> int:
    """Return up to which version a leader's log is committed.

    An entry of an earlier epoch counts only once an entry of the present epoch follows it,
    however many members hold it (section 5.4.2 of the Raft paper). Until then, another leader
    could still overwrite it. `held` is the version that each member has on disk.
    """
    version = sorted(held, reverse=True)[majority - 1]
    position = log.at(version) if version > log.committed else None
    if position is None or position.epoch != epoch:
        return log.committed
    return version
