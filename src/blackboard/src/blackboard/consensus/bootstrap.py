# SPDX-License-Identifier: BSD-3-Clause
"""How a hive begins, and how one that began by mistake ends (see docs/decisions/024).

A blackboard node whose disk is new founds a hive when it hears nobody. It may have lost its disk
while it was cut off from a hive that goes on without it; so what it has taken in alone it hands
over before it joins the others.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.journal import HardState
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, name_of
from blackboard.consensus.messages import AppendReply
from blackboard.domain.talker import BB_ACK, NEW_TASK, SYNC, TASK_STATE
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from random import Random

    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.domain.settings import RaftSettings
    from blackboard.domain.talker import Subscription, Talker

_MIN_BEATS, _MAX_BEATS = 5, 10
"""For so many heartbeats nobody may be heard before a hive is founded."""

_BEATS_BETWEEN_POSTS = 5
"""Heartbeats until a task that was handed over and not answered is handed over again."""


def new_id(random: Random) -> str:
    """Return an id that no other hive, or life of a disk, has."""
    return f"{random.getrandbits(32):08x}"


def newcomer(name: str, random: Random, hive: str = "") -> HardState:
    """Return what a member that knows nothing yet has on disk.

    Args:
        name: Its name.
        random: For the life of its disk.
        hive: Id of the hive that it is going to join, where that is known.
    """
    return HardState(f"{name}#{new_id(random)}", 0, "", Log.of(Snapshot()), hive)


def founder(member_id: str, hive: str) -> HardState:
    """Return what the first member of a new hive writes down."""
    log = Log.of(Snapshot(Position(1, 1), members=(member_id,)))
    return HardState(member_id, 0, "", log, hive)


def awake(
    hard_state: HardState, settings: RaftSettings, now: float, *, voter: bool = True
) -> Member:
    """Return the state of a member that starts with what it has on disk.

    Unless nobody else has a vote, it neither votes nor stands for a while: it does not know whom
    it has followed before it ended.

    Args:
        durable: What it has on disk.
        settings: The hive's timers.
        now: The time by its own clock [s].
        stands_by: Whether it would carry the blackboard.
    """
    alone = hard_state.log.latest.members == (hard_state.member,)
    return Member(
        hard_state.member,
        settings,
        hard_state.log,
        hard_state.epoch,
        hard_state.vote,
        heard=float("-inf") if alone else now,
        quiet_until=float("-inf") if alone else now + settings.election,
        version=hard_state.log.committed,
        hive=hard_state.hive,
        voter=voter,
    )


def hard_state_of(member: Member) -> HardState:
    """Return what a member has to have on disk."""
    return HardState(member.id, member.epoch, member.vote, member.log, member.hive)


class Founding:
    """Waits for a while whether somebody is heard, then founds a hive.

    Meanwhile it says with an acknowledgement of nothing that it is there. Members of a hive answer
    that, whether anybody carries their hive or not.

    Args:
        talker: How it speaks and waits.
        member: Id of the member that founds.
        heartbeat: Time between two looks [s].
        random: So that two that wait do not found at the same time.
        has_joined: Says whether the member belongs to a hive by now.
        found: Founds; called once.
    """

    def __init__(
        self,
        talker: Talker,
        member: str,
        heartbeat: float,
        random: Random,
        has_joined: Callable[[], bool],
        found: Callable[[], None],
    ) -> None:
        self._talker = talker
        self._member = member
        self._heartbeat = heartbeat
        self._left = random.randint(_MIN_BEATS, _MAX_BEATS)
        self._has_joined = has_joined
        self._found = found
        self._known = ""
        self._wait()

    def hear(self, hive: str) -> None:
        """Found nothing any more, because a member of a hive is heard which nobody carries now."""
        if not self._known:
            self._known = hive
            self._talker.warn(
                f"{name_of(self._member)} has no list on its disk and hears members of hive "
                f"{hive}, which nobody carries at present; it waits for that hive and founds no "
                "other beside it. If that hive cannot go on any more, end its members, move their "
                "journals away and start all anew"
            )

    def _wait(self) -> None:
        if self._has_joined():
            return
        if self._left == 0 and not self._known:
            self._found()
            return
        self._left = max(self._left - 1, 0)
        self._talker.publish(BB_ACK, AppendReply(self._member, 0, 0, 0.0))
        self._talker.after(self._heartbeat, self._wait)


class Handover:
    """Posts the tasks that a lone founder has taken in to the hive that it is going to join.

    It does as any operator's program: it posts again what has not been answered, and looks for the
    answers on `bb_sync` and `task_state`.

    Args:
        talker: How it speaks.
        name: Of the founder.
        to: Id of the other hive.
        records: What it has on its list.
    """

    def __init__(self, talker: Talker, name: str, to: str, records: Iterable[TaskRecord]) -> None:
        self._talker = talker
        self._name = name
        self._to = to
        self._open = {
            record.task.id: record.task
            for record in records
            if not record.state.is_terminal and not record.parent
        }
        self._beats = 0
        self._ears: list[Subscription] = []
        if self._open:
            self._ears.append(talker.subscribe(SYNC, self._hear_list))
            self._ears.append(talker.subscribe(TASK_STATE, self._hear_update))

    @property
    def is_done(self) -> bool:
        """Whether every task has been answered."""
        return not self._open

    def beat(self) -> None:
        """Post what is due; called at every heartbeat."""
        if self._beats % _BEATS_BETWEEN_POSTS == 0:
            for task in self._open.values():
                self._talker.publish(NEW_TASK, task)
        self._beats += 1

    def end(self) -> None:
        """Listen no longer."""
        for ear in self._ears:
            ear.cancel()

    def _hear_list(self, known: TaskList) -> None:
        """Note what is on the other hive's list; what this one's own blackboard says is late."""
        if known.hive == self._to:
            for record in known.records:
                self._open.pop(record.task.id, None)

    def _hear_update(self, update: TaskUpdate) -> None:
        """Note what the other hive's blackboard does not take in, and tell a person."""
        if update.state is not TaskState.REJECTED:
            return
        task = self._open.pop(update.task_id, None)
        if task is not None:
            self._talker.warn(
                f"{self._name} had taken in {task.id} and cannot hand it over: {update.reason}"
            )
