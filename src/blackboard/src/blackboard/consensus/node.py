# SPDX-License-Identifier: BSD-3-Clause
"""One member of the hive: connects the pure Raft core to messages, timers and the disk.

`RaftNode` feeds events from the Talker to `step.step`. It writes the new state to the journal
before it sends any message that relies on it; new entries, of which a leader says only that it
proposes them, it sends first. It tells the blackboard beside it when the member
becomes the leader and when it steps down.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

from blackboard.consensus import leader, step
from blackboard.consensus.bootstrap import hard_state_of, new_hive, new_id, new_member, restore
from blackboard.consensus.hive_filter import MemberFilter
from blackboard.consensus.member import Role, has_lease, name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, Heartbeat, Message
from blackboard.consensus.step import Died, HalfTick, Propose, Tick
from blackboard.consensus.task_list import Coalescer, committed_list
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE, SYNC
from blackboard.errors import JournalError
from hive_common.map_id import NO_MAP, MapId

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from random import Random

    from blackboard.consensus.journal import HardState, Journal
    from blackboard.consensus.member import Member
    from blackboard.consensus.step import Event
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.charger import Grant
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.settings import RaftSettings
    from blackboard.domain.talker import Talker, Timer, Topic


_TOPICS: dict[type[Message], Topic[Any]] = {
    Heartbeat: BACKUP,
    AppendEntries: BB_ENTRIES,
    AppendReply: BB_ACK,
    Ballot: BB_VOTE,
}


_MIN_SILENCE, _MAX_SILENCE = 5, 10
"""Heartbeats without hearing anybody before a member bootstraps a hive."""

_MOST_HELD = 0.5
"""Part of a heartbeat for which a new record waits for another change to be written with it."""


class Carrier(Protocol):
    """The blackboard beside a `RaftNode`."""

    def became_leader(self) -> None:
        """Start deciding: this member leads, and its list contains everything committed."""

    def stepped_down(self) -> None:
        """Stop deciding at once."""


class RaftNode:
    """One member of the hive.

    Args:
        member: Its name.
        random: Keeps members from acting at the same time.
        bootstrap: Whether it bootstraps a hive if its disk is new and it hears nobody.
        voter: Whether it is willing to lead. A learner holds the log, has no vote and listens to
            the leader only.
    """

    def __init__(
        self,
        talker: Talker,
        member: str,
        settings: RaftSettings,
        journal: Journal,
        random: Random,
        *,
        bootstrap: bool = False,
        voter: bool = True,
    ) -> None:
        self._talker = talker
        self._settings = settings
        self._journal = journal
        self._random = random
        self._bootstraps = bootstrap
        self._carrier: Carrier | None = None
        self._serving = False
        self._waiting: deque[tuple[int, Callable[[], None]]] = deque()
        self._held: list[tuple[TaskRecord, Callable[[], None]]] = []
        self._with_held: Mapping[str, TaskRecord] = {}
        self._hold_timer: Timer | None = None
        self._to_everyone = Coalescer(talker, settings.sync_period, self._publish_list)
        self._to_robot: Coalescer | None = None
        self._granted: dict[str, float] = {}
        self._offline: tuple[str, ...] = ()
        self._make_room: tuple[str, ...] = ()
        self._map = self._leaders_map = NO_MAP
        self._robot_lease = 0.0
        self._filter = MemberFilter(
            talker, member, settings.election, settings.member_timeout, bootstraps=bootstrap
        )
        known = journal.load() or new_member(member, random)
        self._member = restore(known, settings, talker.now(), voter=voter)

    def serve(self, carrier: Carrier) -> None:
        """Tell a blackboard from now on when this member leads."""
        self._carrier = carrier

    def start(self) -> None:
        """Start listening and sending."""
        from_voters = (BB_VOTE, BB_ACK) if self._member.voter else ()
        for topic in (BACKUP, BB_ENTRIES, *from_voters):
            self._talker.subscribe(topic, self._hear)
        self._talker.every(self._settings.heartbeat, self._tick)
        if self._bootstraps and not self._member.hive:
            self._await_hive(self._random.randint(_MIN_SILENCE, _MAX_SILENCE))
        self._tick()

    @property
    def member(self) -> Member:
        """The state of this member."""
        return self._member

    @property
    def epoch(self) -> int:
        """The highest epoch that this member has seen."""
        return self._member.epoch

    @property
    def hive(self) -> str:
        """The id of the hive; empty while this member belongs to none."""
        return self._member.hive

    @property
    def leader(self) -> tuple[str, ...] | None:
        """Name of the leader; None if unknown."""
        return (self._member.leader,) if self._member.leader else None

    @property
    def carriers(self) -> tuple[str, ...] | None:
        """Names of the leader and of the backup; None if unknown."""
        return (self._member.leader, self._member.backup) if self._member.leader else None

    def obeys(self, hive: str, epoch: int) -> bool:
        """Return whether to obey the blackboard of a hive and an epoch; see `HiveFilter`."""
        return self._filter.obeys(hive, epoch, self._member)

    @property
    def records(self) -> Mapping[str, TaskRecord]:
        """Every task the hive knows by id, in the order they were posted; also what is held."""
        return self._with_held if self._held else self._member.log.latest.records

    @property
    def earlier(self) -> int:
        """The highest assignment number of any task that was forgotten."""
        return self._member.log.latest.earlier

    @property
    def grants(self) -> Mapping[str, Grant]:
        """Which robot has which charger, by the charger's name; also what is not committed yet."""
        return self._member.log.latest.grants

    def get(self, task_id: str) -> TaskRecord | None:
        """Return the record of a task, or None if the task is unknown."""
        return self.records.get(task_id)

    def tell(self) -> None:
        """Publish the task list within the sync period."""
        self._to_everyone.request()

    def follow(self, hear: Callable[[TaskList], None]) -> None:
        """Pass the committed list to the robot beside this member soon after every change."""
        self._to_robot = Coalescer(
            self._talker, self._settings.sync_period, lambda: hear(committed_list(self._member))
        )

    def show(self) -> None:
        """Pass the list to that robot within the sync period."""
        if self._to_robot is not None:
            self._to_robot.request()

    def may_act(self) -> bool:
        """Return whether this member leads; step down if it has lost the leader lease."""
        if self._serving and not has_lease(self._member, self._talker.now()):
            self._step_down()
        return self._serving

    def hold(self, record: TaskRecord, then: Callable[[], None]) -> None:
        """Replicate a new record with the next change, or alone after a moment.

        So a task whose bids come at once is written to all disks together with its assignment.
        `then` is called as by `commit`.
        """
        if not self.may_act():
            return
        if self._hold_timer is None:
            patience = _MOST_HELD * self._settings.heartbeat
            self._hold_timer = self._talker.after(patience, self._write_held)
        self._with_held = {**self.records, record.task.id: record}
        self._held.append((record, then))

    def commit(
        self,
        records: tuple[TaskRecord, ...],
        then: Callable[[], None],
        forgotten: tuple[str, ...] = (),
    ) -> None:
        """Replicate new or changed records, and those that are held.

        Args:
            records: What to write; if empty, wait for what was written before.
            then: Called once a majority has it on disk; never if this member steps down before.
            forgotten: Ids of parts that leave the list, because one of `records` is their whole.
        """
        if not self.may_act():
            return
        held = self._take_held()
        # A record that has changed while it was held is written once, in its place.
        changed = {each.task.id: each for each in (*(one for one, _ in held), *records)}
        if changed:
            self._step(Propose(tuple(changed.values()), forgotten))
        version = self._member.log.position.version
        for after in (*(after for _, after in held), then):
            if not self._serving:
                return
            if version > self._member.log.committed:
                self._waiting.append((version, after))
            else:
                after()

    def forget(self, task_ids: tuple[str, ...]) -> None:
        """Remove tasks that have ended from the list."""
        if task_ids and self.may_act():
            self._write_held()
            self._step(Propose((), task_ids))

    def give_chargers(self, grants: tuple[Grant, ...]) -> None:
        """Give chargers to robots; a grant to nobody takes the charger from its robot."""
        if grants and self.may_act():
            self._write_held()
            self._step(Propose((), grants=grants))

    def _write_held(self) -> None:
        if self._held:
            self.commit((), lambda: None)

    def _take_held(self) -> list[tuple[TaskRecord, Callable[[], None]]]:
        """Return what is held, which no longer is."""
        if self._hold_timer is not None:
            self._hold_timer.cancel()
        held, self._held, self._hold_timer = self._held, [], None
        return held

    def grant(self, robot_id: str, sent: float, robot_lease: float) -> None:
        """Renew a robot's lease with every heartbeat: for `robot_lease` [s] after `sent` [s].

        `sent` is when the robot sent its last status, by its own clock.
        """
        self._granted[robot_id] = sent
        self._robot_lease = robot_lease

    def tell_offline(self, robots: tuple[str, ...]) -> None:
        """Name the robots that are not heard with every heartbeat from now on."""
        self._offline = robots

    def ask_for_room(self, robots: tuple[str, ...]) -> None:
        """Ask robots with every heartbeat from now on to leave their chargers to others."""
        self._make_room = robots

    def tell_map(self, used: MapId) -> None:
        """Say which map this member uses, with every heartbeat that it sends as the leader."""
        self._map = used

    @property
    def leaders_map(self) -> MapId:
        """The map that the leader uses; no map while that is unknown."""
        return self._map if self._serving else self._leaders_map

    def _hear(self, message: Message) -> None:
        if self._filter.accepts(message, self._member):
            if isinstance(message, Heartbeat):
                self._leaders_map = message.map
            self._step(message)
        else:
            self._pauses()

    def _tick(self) -> None:
        if not self._pauses():
            self._step(Tick(self._random.random()))
            if self._member.role is Role.LEADER:
                self._talker.after(self._settings.heartbeat / 2, self._half_tick)
        elif (hard_state := self._filter.join(self._random)) is not None:
            self._restart(hard_state)

    def _half_tick(self) -> None:
        if not self._pauses():
            self._step(HalfTick())

    def _pauses(self) -> bool:
        """Decide nothing while a larger hive is heard; return whether one is."""
        pauses = self._filter.pauses(self._member)
        if pauses and self._member.role is not Role.FOLLOWER:
            self._step_down()
        return pauses

    def _await_hive(self, beats: int) -> None:
        """Bootstrap a hive after some heartbeats, unless somebody is heard.

        Meanwhile, announce this member by an AppendReply to nobody. The members of a hive answer
        that, even while they have no leader.
        """
        if self._member.hive:
            return
        if beats <= 0 and not self._filter.known_hive:
            self._restart(new_hive(self._member.id, new_id(self._random)))
            self._tick()
            return
        self._talker.publish(BB_ACK, AppendReply(self._member.id, 0, 0, 0.0))
        self._talker.after(self._settings.heartbeat, partial(self._await_hive, beats - 1))

    def _restart(self, hard_state: HardState) -> None:
        self._journal.save(hard_state)
        voter, now = self._member.voter, self._talker.now()
        self._member = restore(hard_state, self._settings, now, voter=voter)

    def _step(self, event: Event) -> None:
        before = self._member
        after, messages = step.step(before, event, self._talker.now())
        if isinstance(event, Propose):
            # The others write while this member does; it counts itself only once it has written.
            self._send_all(messages)
            messages = []
        if not self._save(before, after):
            return
        self._member = after
        self._send_all(messages)
        self._react(before, after)

    def _save(self, before: Member, after: Member) -> bool:
        """Write changes of the hard state to disk; without it, the member sends nothing."""
        same_log = after.log.base is before.log.base and after.log.entries is before.log.entries
        # As in Raft, what is committed is not part of it: the next leader finds out again.
        if same_log and after.epoch == before.epoch and after.vote == before.vote:
            return True
        try:
            self._journal.save(hard_state_of(after))
        except JournalError as error:
            name = name_of(before.id)
            self._talker.warn(f"{name} cannot take part in the hive: {error}")
            if before.role is Role.LEADER:
                self._step_down()
            return False
        return True

    def _send_all(self, messages: Iterable[Message]) -> None:
        for message in messages:
            self._send(message)

    def _send(self, message: Message) -> None:
        if isinstance(message, Heartbeat):
            message = replace(
                message,
                heard=dict(self._granted),
                robot_lease=self._robot_lease,
                offline=self._offline,
                make_room=self._make_room,
                map=self._map,
            )
        self._talker.publish(_TOPICS[type(message)], message, message.to)

    def _step_down(self) -> None:
        before = self._member
        self._member = leader.step_down(before, self._talker.now())
        self._react(before, self._member)

    def _react(self, before: Member, after: Member) -> None:
        """Tell the blackboard and the robot beside this member what has changed."""
        if after.log.committed != before.log.committed:
            self.show()
        if after.leader not in {"", before.leader, name_of(after.id)}:
            died = Died(after.leader, after.epoch)
            self._talker.watch(after.leader, partial(self._handle_death, died))
        if after.role is not Role.LEADER:
            if before.role is Role.LEADER:
                self._stop_serving(before, after)
            return
        committed = after.log.committed
        if not self._serving:
            position = after.log.at(committed)
            if position is None or position.epoch != after.epoch:
                return
            self._serving = True
            self._publish_list()
            if self._carrier is not None:
                self._carrier.became_leader()
        elif committed > before.log.committed:
            self.tell()
        # An old answer may commit an entry without renewing the leader lease.
        while (
            self._waiting
            and self._waiting[0][0] <= committed
            and has_lease(self._member, self._talker.now())
        ):
            self._waiting.popleft()[1]()

    def _handle_death(self, died: Died) -> None:
        if not self._filter.larger_hive:
            self._step(died)

    def _publish_list(self) -> None:
        if self._serving:
            self._talker.publish(SYNC, committed_list(self._member))

    def _stop_serving(self, before: Member, after: Member) -> None:
        if larger := self._filter.larger_hive:
            reason = f"it hears hive {larger}, to which its own gives way"
        elif after.epoch > before.epoch:
            reason = f"epoch {after.epoch} has begun"
        else:
            reason = f"no majority of {', '.join(map(name_of, before.members))} answers"
        self._talker.warn(f"{name_of(after.id)} is no longer the leader: {reason}")
        self._waiting.clear()
        self._take_held()
        if self._serving:
            self._serving = False
            self._granted.clear()
            if self._carrier is not None:
                self._carrier.stepped_down()
