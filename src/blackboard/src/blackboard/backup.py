# SPDX-License-Identifier: BSD-3-Clause
"""Who carries the blackboard, and the copy of the task list that everyone else holds.

Every member of the hive hosts a `Backup`. Underneath is a pure function, `consensus.step`, of a
member's state, an event and the time. `Backup` feeds it from the Talker, has the journal written
before anything is said that relies on it, and tells the blackboard beside it when to begin and
when to stop.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

from blackboard import active, consensus
from blackboard.active import Heartbeat
from blackboard.consensus import Died, LeaseCheck, Tick, Write
from blackboard.election import Ballot
from blackboard.errors import JournalError
from blackboard.journal import Durable
from blackboard.member import Member, Role, name_of
from blackboard.replication import Ack, Entries, Log, Position, Whole
from blackboard.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE, SYNC

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from blackboard.consensus import Event
    from blackboard.journal import Journal
    from blackboard.record import TaskRecord
    from blackboard.settings import BackupSettings
    from blackboard.talker import Talker, Timer

__all__ = ["Backup", "Carrier", "Heartbeat", "TaskList", "founded"]

_TOPICS = {Heartbeat: BACKUP, Entries: BB_ENTRIES, Ack: BB_ACK, Ballot: BB_VOTE}


@dataclass(frozen=True, slots=True)
class TaskList:
    """The task list, as far as it is committed (message BbSynch).

    Attributes:
        epoch: Of the blackboard that wrote it.
        version: Grows with every change.
        records: Every task the hive knows, in the order they were posted.
    """

    epoch: int
    version: int
    records: tuple[TaskRecord, ...] = ()


def founded(name: str) -> Durable:
    """Return what the first member of a new hive writes down, named `name`."""
    return _found(f"{name}#founder")


def _found(member_id: str) -> Durable:
    return Durable(member_id, 0, "", Log.of(Whole(Position(1, 1), members=(member_id,))))


class Carrier(Protocol):
    """The blackboard beside a `Backup`."""

    def became_active(self) -> None:
        """Begin to decide: this member carries the blackboard, and the list is complete."""

    def stepped_down(self) -> None:
        """Stop to decide, at once."""


class Backup:
    """One member's part in keeping the task list, and in who carries the blackboard.

    Args:
        talker: How it hears and speaks.
        member: Name of this member of the hive.
        settings: The hive's timers.
        journal: Its disk.
        random: For what must not happen at the same time on two members.
        founds: Whether it founds a hive when its disk is new and nobody else is heard.
    """

    def __init__(
        self,
        talker: Talker,
        member: str,
        settings: BackupSettings,
        journal: Journal,
        random: Random,
        *,
        founds: bool = False,
    ) -> None:
        self._talker = talker
        self._settings = settings
        self._journal = journal
        self._random = random
        self._founds = founds
        self._carrier: Carrier | None = None
        self._serving = False
        self._waiting: deque[tuple[int, Callable[[], None]]] = deque()
        self._sync: Timer | None = None
        self._heard: dict[str, float] = {}
        self._robot_lease = 0.0
        fresh = f"{member}#{random.getrandbits(32):08x}"
        self._member = self._restore(journal.load() or Durable(fresh, 0, "", Log.of(Whole())))

    def _restore(self, durable: Durable) -> Member:
        """Return the state of a member that starts with what it has on disk."""
        now = self._talker.now()
        alone = durable.log.latest.members == (durable.member,)
        return Member(
            durable.member,
            self._settings,
            durable.log,
            durable.epoch,
            durable.vote,
            heard=float("-inf") if alone else now,
            quiet_until=float("-inf") if alone else now + self._settings.election,
            version=durable.log.committed,
        )

    def serve(self, carrier: Carrier) -> None:
        """Tell a blackboard from now on when to begin and when to stop."""
        self._carrier = carrier

    def start(self) -> None:
        """Begin to listen and to speak."""
        for topic in (BACKUP, BB_ENTRIES, BB_VOTE):
            self._talker.subscribe(topic, self._step)
        self._talker.subscribe(BB_ACK, self._hear_ack)
        self._talker.every(self._settings.heartbeat, self._tick)
        if self._founds and not self._member.members:
            self._say_that_it_founds(round(5 * self._random.random()) + 5)
        self._tick()

    @property
    def member(self) -> Member:
        """The state of this member."""
        return self._member

    @property
    def name(self) -> str:
        """The name of this member."""
        return name_of(self._member.id)

    @property
    def epoch(self) -> int:
        """The highest epoch that this member has seen."""
        return self._member.epoch

    @property
    def records(self) -> tuple[TaskRecord, ...]:
        """Every task the hive knows, in the order they were posted."""
        return tuple(self._member.log.latest.records.values())

    def get(self, task_id: str) -> TaskRecord | None:
        """Return what is known of a task, or None where it is unknown."""
        return self._member.log.latest.records.get(task_id)

    def may_act(self) -> bool:
        """Return whether the blackboard here is the active one; find out that it no longer is."""
        if self._serving:
            self._step(LeaseCheck())
        return self._serving

    def commit(self, records: tuple[TaskRecord, ...], then: Callable[[], None]) -> None:
        """Have records, new or changed, written down by a majority of the hive's members.

        Args:
            records: What is new; where it is nothing, what has been written before is waited for.
            then: Called once it can no longer be lost; never if this member steps down before.
        """
        if not self.may_act():
            return
        if records:
            self._step(Write(records))
        if not self._serving:
            return
        version = self._member.log.position.version
        if version > self._member.log.committed:
            self._waiting.append((version, then))
        else:
            then()

    def grant(self, robot_id: str, sent: float, robot_lease: float) -> None:
        """Have a robot told with every heartbeat which of its statuses was heard last.

        Args:
            robot_id: Who is told.
            sent: When it sent the status, by its own clock [s].
            robot_lease: How long it may work from then on [s].
        """
        self._heard[robot_id] = sent
        self._robot_lease = robot_lease

    def tell(self) -> None:
        """Have the task list told to everyone within the sync period."""
        if self._sync is None:
            self._sync = self._talker.after(self._settings.sync_period, self._publish_sync)

    def _hear_ack(self, ack: Ack) -> None:
        """Take in what another member has on disk; only the active one is concerned."""
        if self._member.role is Role.ACTIVE:
            self._step(ack)

    def _tick(self) -> None:
        self._step(Tick(self._random.random()))

    def _step(self, event: Event) -> None:
        before = self._member
        after, said = consensus.step(before, event, self._talker.now())
        if not self._write_down(before, after):
            return
        self._member = after
        for message in said:
            self._talker.publish(_TOPICS[type(message)], self._with_leases(message))
        self._notice(before, after)

    def _with_leases(self, message: object) -> object:
        """Return what is to be said; a heartbeat also says which robots were heard."""
        if not isinstance(message, Heartbeat):
            return message
        return replace(message, heard=tuple(self._heard.items()), robot_lease=self._robot_lease)

    def _write_down(self, before: Member, after: Member) -> bool:
        """Put on disk what must not be forgotten; a member that cannot do so says nothing."""
        if after.log is before.log and after.epoch == before.epoch and after.vote == before.vote:
            return True
        try:
            self._journal.save(Durable(after.id, after.epoch, after.vote, after.log))
        except JournalError as error:
            self._talker.warn(f"{self.name} cannot take part in the hive: {error}")
            if before.role is Role.ACTIVE:
                self._member = active.step_down(before, self._talker.now())
                self._notice(before, self._member)
            return False
        return True

    def _notice(self, before: Member, after: Member) -> None:
        """Tell the blackboard what has become of this member."""
        if after.active != before.active and after.active not in {"", self.name}:
            self._watch(after.active, after.epoch)
        if before.role is Role.ACTIVE and after.role is not Role.ACTIVE:
            self._stop_serving(before, after)
        if after.role is not Role.ACTIVE:
            return
        committed = after.log.committed
        if not self._serving:
            position = after.log.at(committed)
            if position is None or position.epoch != after.epoch:
                return
            self._serving = True
            self._publish_sync()
            if self._carrier is not None:
                self._carrier.became_active()
        elif committed > before.log.committed:
            self.tell()
        while self._waiting and self._waiting[0][0] <= committed:
            self._waiting.popleft()[1]()

    def _watch(self, name: str, epoch: int) -> None:
        self._talker.watch(name, lambda: self._step(Died(name, epoch)))

    def _stop_serving(self, before: Member, after: Member) -> None:
        reason = (
            f"epoch {after.epoch} has begun"
            if after.epoch > before.epoch
            else f"no majority of {', '.join(map(name_of, before.members))} answers"
        )
        self._talker.warn(f"{self.name} no longer carries the blackboard: {reason}")
        self._waiting.clear()
        if self._serving:
            self._serving = False
            self._heard.clear()
            if self._carrier is not None:
                self._carrier.stepped_down()

    def _publish_sync(self) -> None:
        self._sync = None
        if self._serving:
            log = self._member.log
            records = tuple(log.stable.records.values())
            self._talker.publish(SYNC, TaskList(self._member.epoch, log.committed, records))

    def _say_that_it_founds(self, times: int) -> None:
        """Found a hive unless somebody else is there or is about to."""
        if self._member.epoch:
            return
        if times == 0:
            durable = _found(self._member.id)
            self._journal.save(durable)
            self._member = self._restore(durable)
            self._tick()
            return
        self._talker.publish(BB_ACK, Ack(self._member.id, 0, 0, 0.0))
        self._talker.after(self._settings.heartbeat, lambda: self._say_that_it_founds(times - 1))
