# SPDX-License-Identifier: BSD-3-Clause
"""Who carries the blackboard, and the copy of the task list that everyone else holds.

Every member of the hive hosts a `RaftNode`. Underneath is a pure function, `step.step`, of a
member's state, an event and the time. `RaftNode` feeds it from the Talker, has the journal written
before anything is said that relies on it, and tells the blackboard beside it when to begin and
when to stop.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from blackboard.consensus import leader, step
from blackboard.consensus.bootstrap import (
    Founding,
    awake,
    founder,
    hard_state_of,
    new_id,
    newcomer,
)
from blackboard.consensus.hive_filter import MemberFilter
from blackboard.consensus.member import Role, has_lease, name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, Heartbeat
from blackboard.consensus.step import Died, LeaseCheck, Tick, Write
from blackboard.consensus.task_list import Sync
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from random import Random

    from blackboard.consensus.journal import HardState, Journal
    from blackboard.consensus.member import Member
    from blackboard.consensus.messages import Message
    from blackboard.consensus.step import Event
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.settings import RaftSettings
    from blackboard.domain.talker import Talker


_TOPICS = {Heartbeat: BACKUP, AppendEntries: BB_ENTRIES, AppendReply: BB_ACK, Ballot: BB_VOTE}


class Carrier(Protocol):
    """The blackboard beside a `RaftNode`."""

    def became_leader(self) -> None:
        """Begin to decide: this member carries the blackboard, and the list is complete."""

    def stepped_down(self) -> None:
        """Stop to decide, at once."""


class RaftNode:
    """One member's part in keeping the task list, and in who carries the blackboard.

    Args:
        talker: How it hears and speaks.
        member: Name of this member of the hive.
        settings: The hive's timers.
        journal: Its disk.
        random: For what must not happen at the same time on two members.
        founds: Whether it founds a hive when its disk is new and nobody else is heard.
        stands_by: Whether it would carry the blackboard. Who would not holds the list, has no vote
            and hears the active one only.

    Attributes:
        tell: Has the task list told to everyone within the sync period.
        follow: Has the robot beside this member told the list soon after every change.
        show: Has it told to that robot within the sync period.
    """

    def __init__(
        self,
        talker: Talker,
        member: str,
        settings: RaftSettings,
        journal: Journal,
        random: Random,
        *,
        founds: bool = False,
        voter: bool = True,
    ) -> None:
        self._talker = talker
        self._settings = settings
        self._journal = journal
        self._random = random
        self._founds = founds
        self._carrier: Carrier | None = None
        self._serving = False
        self._waiting: deque[tuple[int, Callable[[], None]]] = deque()
        self._sync = Sync(
            talker, settings.sync_period, lambda: self._member, lambda: self._serving
        )
        self.tell = self._sync.tell
        self.follow = self._sync.follow
        self.show = self._sync.show
        self._heard: dict[str, float] = {}
        self._robot_lease = 0.0
        self._border = MemberFilter(talker, member, settings.election)
        known = journal.load() or newcomer(member, random)
        self._member = awake(known, settings, talker.now(), voter=voter)

    def serve(self, carrier: Carrier) -> None:
        """Tell a blackboard from now on when to begin and when to stop."""
        self._carrier = carrier

    def start(self) -> None:
        """Begin to listen and to speak."""
        among_equals = (BB_VOTE, BB_ACK) if self._member.voter else ()
        for topic in (BACKUP, BB_ENTRIES, *among_equals):
            self._talker.subscribe(topic, self._hear)
        heartbeat = self._settings.heartbeat
        self._talker.every(heartbeat, self._tick)
        if self._founds and not self._member.hive:
            self._border.founding = Founding(
                self._talker,
                self._member.id,
                heartbeat,
                self._random,
                lambda: bool(self._member.hive),
                self._found,
            )
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
    def hive(self) -> str:
        """The id of the hive; empty where this member belongs to none yet."""
        return self._member.hive

    @property
    def leader(self) -> tuple[str, ...] | None:
        """Name of the member that carries the blackboard; None where that is not known."""
        return (self._member.leader,) if self._member.leader else None

    @property
    def carriers(self) -> tuple[str, ...] | None:
        """Names of that member and its backup; None where they are not known."""
        return (self._member.leader, self._member.backup) if self._member.leader else None

    def obeys(self, hive: str, epoch: int) -> bool:
        """Return whether the blackboard of a hive and an epoch is to be obeyed; see `HiveFilter`."""
        return not self._border.refuses(hive, epoch, self._member)

    @property
    def records(self) -> Mapping[str, TaskRecord]:
        """Every task the hive knows by id, in the order they were posted."""
        return self._member.log.latest.records

    @property
    def earlier(self) -> int:
        """The highest number of an assignment of any task that was forgotten."""
        return self._member.log.latest.earlier

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

    def forget(self, task_ids: tuple[str, ...]) -> None:
        """Have the list do without some tasks, which have ended."""
        if task_ids and self.may_act():
            self._step(Write((), task_ids))

    def grant(self, robot_id: str, sent: float, robot_lease: float) -> None:
        """Have a robot told with every heartbeat which of its statuses was heard last.

        Args:
            robot_id: Who is told.
            sent: When it sent the status, by its own clock [s].
            robot_lease: How long it may work from then on [s].
        """
        self._heard[robot_id] = sent
        self._robot_lease = robot_lease

    def _hear(self, message: Message) -> None:
        """Take in what a member says, if it is one of this hive."""
        if self._border.lets_in(message, self._member):
            self._step(message)
        else:
            self._give_way()

    def _tick(self) -> None:
        if not self._give_way():
            self._step(Tick(self._random.random()))
        elif (hard_state := self._border.join(self._random)) is not None:
            self._begin_as(hard_state)

    def _give_way(self) -> bool:
        """Decide nothing while a greater hive is heard; return whether one is."""
        if not self._border.gives_way(self._member):
            return False
        before = self._member
        if before.role is not Role.FOLLOWER:
            self._member = leader.step_down(before, self._talker.now())
            self._notice(before, self._member)
        return True

    def _begin_as(self, hard_state: HardState) -> None:
        self._journal.save(hard_state)
        voter = self._member.voter
        now = self._talker.now()
        self._member = awake(hard_state, self._settings, now, voter=voter)

    def _step(self, event: Event) -> None:
        before = self._member
        after, said = step.step(before, event, self._talker.now())
        if not self._write_down(before, after):
            return
        self._member = after
        for message in said:
            to = step.concerned(message, event)
            self._talker.publish(_TOPICS[type(message)], self._with_leases(message), to)
        self._notice(before, after)

    def _with_leases(self, message: object) -> object:
        """Return what is to be said; a heartbeat also says which robots were heard."""
        if not isinstance(message, Heartbeat):
            return message
        return replace(message, heard=dict(self._heard), robot_lease=self._robot_lease)

    def _write_down(self, before: Member, after: Member) -> bool:
        """Put on disk what must not be forgotten; a member that cannot do so says nothing."""
        same_list = after.log.base is before.log.base and after.log.entries is before.log.entries
        # What is committed is found out again by whoever is elected next, as in Raft.
        if same_list and after.epoch == before.epoch and after.vote == before.vote:
            return True
        try:
            self._journal.save(hard_state_of(after))
        except JournalError as error:
            self._talker.warn(f"{self.name} cannot take part in the hive: {error}")
            if before.role is Role.LEADER:
                self._member = leader.step_down(before, self._talker.now())
                self._notice(before, self._member)
            return False
        return True

    def _notice(self, before: Member, after: Member) -> None:
        """Tell the blackboard and the robot here what has become of this member."""
        if after.log.committed != before.log.committed:
            self.show()
        if after.leader != before.leader and after.leader not in {"", self.name}:
            self._watch(after.leader, after.epoch)
        if before.role is Role.LEADER and after.role is not Role.LEADER:
            self._stop_serving(before, after)
        if after.role is not Role.LEADER:
            return
        committed = after.log.committed
        if not self._serving:
            position = after.log.at(committed)
            if position is None or position.epoch != after.epoch:
                return
            self._serving = True
            self._sync.publish()
            if self._carrier is not None:
                self._carrier.became_leader()
        elif committed > before.log.committed:
            self.tell()
        # What commits a change may be an old answer, which no longer makes this the active one.
        while self._waiting and self._waiting[0][0] <= committed and self._has_lease():
            self._waiting.popleft()[1]()

    def _has_lease(self) -> bool:
        return has_lease(self._member, self._talker.now())

    def _watch(self, name: str, epoch: int) -> None:
        self._talker.watch(name, lambda: self._learn_of_death(Died(name, epoch)))

    def _learn_of_death(self, death: Died) -> None:
        if not self._border.makes_way_for():
            self._step(death)

    def _stop_serving(self, before: Member, after: Member) -> None:
        if greater := self._border.makes_way_for():
            reason = f"hive {greater} is heard, which has more members"
        elif after.epoch > before.epoch:
            reason = f"epoch {after.epoch} has begun"
        else:
            reason = f"no majority of {', '.join(map(name_of, before.members))} answers"
        self._talker.warn(f"{self.name} no longer carries the blackboard: {reason}")
        self._waiting.clear()
        if self._serving:
            self._serving = False
            self._heard.clear()
            if self._carrier is not None:
                self._carrier.stepped_down()

    def _found(self) -> None:
        """Found a hive, because nobody was heard."""
        self._begin_as(founder(self._member.id, new_id(self._random)))
        self._tick()
