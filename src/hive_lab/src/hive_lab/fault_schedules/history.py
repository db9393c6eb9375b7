# SPDX-License-Identifier: BSD-3-Clause
"""What one simulated hive has committed, and that no member contradicts it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Callable, Iterator

    from blackboard.consensus.log import Entry, Log, Position
    from blackboard.consensus.member import Member
    from blackboard.domain.record import TaskRecord


class Violation(AssertionError):  # noqa: N818  (the word the docs use)
    """A property does not hold; the text names it, the time, and the observation."""


class History:
    """Everything that one hive has committed; a founder without its disk bootstraps another hive.

    Args:
        broken: Ends the run; takes the broken property and the observation.
        told: How often it was published that a task has ended, by id.

    Attributes:
        truth: Every listed task as last committed.
        forgotten: Every task that was removed from the list after its end, and every part of a
            task whose split was undone.
        joined: Those parts, as they left the list.
    """

    def __init__(self, broken: Callable[[str, str], NoReturn], told: Counter[str]) -> None:
        self._broken = broken
        self._told = told
        self._told_before: dict[str, int] = {}
        self.forgotten: dict[str, TaskRecord] = {}
        self.joined: list[TaskRecord] = []
        self._leader_of: dict[int, str] = {}
        self._committed: dict[int, Position] = {}
        self._written: dict[Position, Entry] = {}
        self._applied = 0
        self.truth: dict[str, TaskRecord] = {}

    def go_on_from(self, log: Log, before: History) -> None:
        """Begin with the list of the only member of a hive that was recovered as this.

        The member commits all that it has as soon as it leads.
        """
        self.truth = dict(log.latest.records)
        self.forgotten = {
            task: record
            for task, record in {**before.forgotten, **before.truth}.items()
            if task not in log.latest.records and record.state.is_terminal
        }
        self._applied = log.position.version
        self._committed[self._applied] = log.position

    @property
    def applied(self) -> int:
        """Version of the last change that any member has committed; 0 if there is none."""
        return self._applied

    def follow(
        self, member: Member, before: Member | None
    ) -> Iterator[tuple[TaskRecord | None, TaskRecord]]:
        """Check a member's committed entries against everyone else's, since its state `before`.

        Yields:
            Each changed record: as it was, None if it is new, and as it is.
        """
        log = member.log
        for entry in reversed(log.entries):
            if self._written.get(entry.position) is entry:
                break  # everything before it was written too
            self._written[entry.position] = entry
        first = 0 if before is None else before.log.committed
        base = log.base.position
        folded = before.log if before and before.log.at(base.version) == base else log
        for version in range(first, log.committed + 1):
            # Entries compacted in this event are still in the log before it.
            position = log.at(version) or folded.at(version)
            if position is None:
                continue
            known = self._committed.setdefault(version, position)
            if known != position:
                self._broken(
                    "one history",
                    f"{member.id} has committed {position} where another committed {known}",
                )
            if position in self._written and version > self._applied:
                self._applied = version
                yield from self._apply(member, self._written[position])

    def _apply(
        self, member: Member, entry: Entry
    ) -> Iterator[tuple[TaskRecord | None, TaskRecord]]:
        whole_again = {record.task.id for record in entry.records if not record.parts}
        for task_id in entry.forgotten:
            known = self.truth.get(task_id)
            if known is not None and known.parent in whole_again:
                self._join(member, known)
            else:
                self._forget(member, task_id)
        for record in entry.records:
            known = self.truth.get(record.task.id)
            self.truth[record.task.id] = record
            yield known, record
            if known is None:
                self.forgotten.pop(record.task.id, None)
                self._told_before[record.task.id] = self._told[record.task.id]
            elif known.state.is_terminal and record.state != known.state:
                self._broken(
                    "done once",
                    f"{member.id} turns {record.task.id} from {known.state.name} "
                    f"to {record.state.name}",
                )

    def _join(self, member: Member, part: TaskRecord) -> None:
        """Check that no robot has a part that is removed because its task is whole again."""
        name = part.task.id
        if part.state is not TaskState.WAITING or part.step or part.parts:
            what = f"{member.id} joins {name}, which is {part.state.name} at step {part.step}"
            self._broken("nothing is lost", what)
        self.forgotten[name] = self.truth.pop(name)
        self.joined.append(part)

    def _forget(self, member: Member, task_id: str) -> None:
        """Check that a removed task has ended, and that this was published."""
        record = self.truth.pop(task_id, None)
        if record is None or not record.state.is_terminal:
            state = "not on the list" if record is None else record.state.name
            self._broken("nothing is lost", f"{member.id} forgets {task_id}, which is {state}")
        if self._told[task_id] <= self._told_before.get(task_id, 0):
            self._broken("nothing is lost", f"{member.id} forgets {task_id}, whose end is untold")
        self.forgotten[task_id] = record

    def take_over(self, member: Member) -> None:
        """Check that a new leader is alone in its epoch and lacks no committed entry."""
        rival = self._leader_of.setdefault(member.epoch, member.id)
        if rival != member.id:
            self._broken(
                "one authority",
                f"{rival} and {member.id} are both leaders in epoch {member.epoch}",
            )
        held = member.log.at(self._applied)
        known = self._committed.get(self._applied)
        if held is not None and known is not None and held != known:
            self._broken(
                "one history",
                f"{member.id} becomes leader with {held} where {known} was committed",
            )
        missing = self._applied - member.log.position.version
        kept = member.log.latest.records.keys() | {
            task_id
            for entry in member.log.entries
            if entry.version > self._applied
            for task_id in entry.forgotten
        }
        lost = [task_id for task_id in self.truth if task_id not in kept]
        if missing > 0 or lost:
            self._broken(
                "nothing is lost",
                f"{member.id} becomes leader and lacks {missing} changes; tasks missing: {lost}",
            )
