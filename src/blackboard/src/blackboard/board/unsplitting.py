# SPDX-License-Identifier: BSD-3-Clause
"""Undoes the split of a task that nobody has begun, once one robot can take the whole.

The parts are taken back from the robots that have them and kept out of auctions; then the whole is
auctioned in their place. What undoes the split is the award of the whole: one change of the task
list gives it to its winner and removes the parts. If no robot takes it, the parts are auctioned
again, and nothing is tried anew before another robot could take the whole. So a split is never
undone for nothing, and a robot that goes in and out of service costs some seconds at most
`MOST_ATTEMPTS` times.

A part may be removed only if it is at work nowhere and no robot can begin it any more. Therefore
every robot that ever got it has to have handed it back unbegun, as heard by this leader, and
orders for it have to be too old: robots ignore orders that are older than a lease.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from blackboard.auction.splitting import part_ids, unsplit
from blackboard.domain.record import OrderKind
from blackboard.domain.task import TaskState, TaskType

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping

    from blackboard.board.orders import Orders
    from blackboard.board.watch import Presence
    from blackboard.consensus.node import RaftNode
    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.domain.talker import Talker

MOST_ATTEMPTS = 3
"""Attempts to undo one split; each leader counts its own."""

_LONGEST = 4.0
"""An attempt that takes longer than this many times `quiet` is given up."""

_NOT_BEGUN = {TaskState.WAITING, TaskState.ASSIGNED}


@dataclass(frozen=True, slots=True)
class _HandBack:
    """A robot has handed a part back unbegun, as did those that had it before."""

    assignment: int
    heard: float  # when [s]


class Offers(NamedTuple):
    """How a look changes what auctions offer."""

    anew: frozenset[str]  # tasks to be withdrawn first: wholes and parts that change places
    more: bool  # whether tasks may wait now that did not


class Unsplitting:
    """Knows which splits are being undone.

    Args:
        quiet: A robot obeys no order to take a task that is older than this [s].
    """

    def __init__(
        self, talker: Talker, node: RaftNode, orders: Orders, presence: Presence, quiet: float
    ) -> None:
        self._talker = talker
        self._node = node
        self._orders = orders
        self._presence = presence
        self._quiet = quiet
        self.begin()

    def begin(self) -> None:
        """Count from now on: this leader does not know who handed parts back to others."""
        self._handed_back: dict[str, _HandBack] = {}
        self._attempts: dict[str, int] = {}
        # By the id of the whole: since when its split is being undone [s], and the robots in
        # service that could carry it at the last attempt.
        self._under_way: dict[str, float] = {}
        self._asked: dict[str, frozenset[str]] = {}
        self._ready: set[str] = set()

    def note_release(self, record: TaskRecord, update: TaskUpdate) -> None:
        """Note that the robot of a part hands it back; `record` is from before that."""
        begun = record.state is not TaskState.ASSIGNED or update.step or update.put_off_for
        if record.parent and not begun and self._is_untouched(record, record.assignment - 1):
            handed_back = _HandBack(record.assignment, self._talker.now())
            self._handed_back[record.task.id] = handed_back

    def has_recalled(self, record: TaskRecord) -> bool:
        """Return whether a part is handed back for the whole rather than tried in vain."""
        return record.parent in self._under_way

    def stop(self, task_ids: Iterable[str]) -> None:
        """Undo some splits no more: a robot has got the whole, or no robot takes it."""
        for task_id in task_ids:
            self._under_way.pop(task_id, None)

    def look(self) -> Offers:
        """Begin what can be undone, and go on with it."""
        now, records = self._talker.now(), self._node.records
        self._forget(records)
        before, ready = set(self._under_way), self._ready
        ordered = {record.task.id for record in self._orders.held()}
        for record in records.values():
            if record.parts and not record.state.is_terminal:
                self._look_at(record, ordered, now)
        self._ready = {name for name in self._under_way if self.is_ready(records[name])}
        changed = before ^ self._under_way.keys()
        family = {part for name in changed for part in part_ids(records[name])}
        return Offers(frozenset(changed | family), bool(changed or self._ready - ready))

    def _forget(self, records: Mapping[str, TaskRecord]) -> None:
        """Forget what is not on the list any more, or has ended."""
        for known in (self._handed_back, self._attempts, self._asked, self._under_way):
            for name in [each for each in known if each not in records]:
                del known[name]
        over = (name for name in self._under_way if records[name].state.is_terminal)
        self.stop(tuple(over))

    def _look_at(self, whole: TaskRecord, ordered: Collection[str], now: float) -> None:
        name, carriers = whole.task.id, self._carriers(whole)
        asked = self._asked[name] = self._asked.get(name, frozenset()) & carriers
        parts = self._parts_not_begun(whole, ordered)
        attempts = self._attempts.get(name, 0)
        if name in self._under_way:
            is_late = now - self._under_way[name] > _LONGEST * self._quiet
            if not parts or not carriers or is_late:
                del self._under_way[name]
        elif parts and carriers - asked and attempts < MOST_ATTEMPTS:
            self._attempts[name], self._asked[name] = attempts + 1, carriers
            self._under_way[name] = now
        if name in self._under_way:
            for part in parts:
                if part.is_held:
                    self._orders.send(part, OrderKind.HAND_BACK_UNBEGUN)

    def offered(self, records: Mapping[str, TaskRecord]) -> Mapping[str, TaskRecord]:
        """Return the task list as auctions see it: wholes that can be joined, and not their parts.

        While the parts come back, neither is offered, nor does a plan move the parts.
        """
        if not self._under_way:
            return records
        seen = {
            name: record
            for name, record in records.items()
            if record.parent not in self._under_way or record.state not in _NOT_BEGUN
        }
        for name in self._under_way:
            if name in seen and self.is_ready(seen[name]):
                seen[name] = unsplit(seen[name])
        return seen

    def is_ready(self, whole: TaskRecord) -> bool:
        """Return whether a robot may get the whole of a split task now, in place of its parts."""
        if whole.task.id not in self._under_way:
            return False
        parts = self._parts_not_begun(whole, ())
        return bool(parts) and all(map(self._is_quiet, parts))

    def _is_quiet(self, part: TaskRecord) -> bool:
        """Return whether no robot obeys an order any more to take a part."""
        last = self._handed_back.get(part.task.id)
        return last is None or self._talker.now() - last.heard >= self._quiet

    def _carriers(self, whole: TaskRecord) -> frozenset[str]:
        """Return the robots in service that say that they can carry the whole."""
        kind = TaskType(whole.task.type)
        told = map(self._presence.last, self._presence.in_service())
        return frozenset(
            status.robot_id
            for status in told
            if status is not None and (status.most_payload(kind) or 0.0) >= whole.task.payload
        )

    def _parts_not_begun(
        self, whole: TaskRecord, ordered: Collection[str]
    ) -> tuple[TaskRecord, ...]:
        """Return the parts of a task; none if one of them may have been begun.

        A part counts as not begun if it waits, or if a robot in service has it by one of the
        `ordered` ids and may still hand it back.
        """
        found = tuple(self._node.get(name) for name in part_ids(whole))
        parts = tuple(part for part in found if part is not None)
        in_service = self._presence.in_service()
        for part in parts:
            numbers = part.assignment - part.is_held
            is_there = not part.is_held or (part.robot in in_service and part.task.id in ordered)
            is_loose = part.state in _NOT_BEGUN and not part.parts and part.step == 0
            if not (is_loose and is_there and self._is_untouched(part, numbers)):
                return ()
        return parts if len(parts) == whole.parts else ()

    def _is_untouched(self, part: TaskRecord, assignment: int) -> bool:
        """Return whether all robots that had a part, up to an assignment, handed it back."""
        last = self._handed_back.get(part.task.id)
        never = assignment == part.earlier
        return never or (last is not None and last.assignment == assignment)
