# SPDX-License-Identifier: BSD-3-Clause
"""How a member starts, how the first one bootstraps a hive, and how a spare hive dissolves.

A blackboard node with a new disk bootstraps a hive if it hears nobody (docs/decisions/024). But it
may have lost its disk while it was cut off from a hive that goes on without it. So before it joins
that hive, it hands over the tasks it has accepted alone.
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
    from blackboard.domain.talker import Talker

_MIN_SILENCE, _MAX_SILENCE = 5, 10
"""Heartbeats without hearing anybody before a member bootstraps a hive."""

_REPOST_INTERVAL = 5
"""Heartbeats until a task that nobody has answered is posted again."""


def new_id(random: Random) -> str:
    """Return a new id of a hive or of a disk."""
    return f"{random.getrandbits(32):08x}"


def new_member(name: str, random: Random, hive: str = "") -> HardState:
    """Return the state of a member with an empty disk.

    Args:
        name: Its name.
        random: For the id of its disk.
        hive: Id of the hive that it joins, if known.
    """
    return HardState(f"{name}#{new_id(random)}", 0, "", Log.of(Snapshot()), hive)


def new_hive(member_id: str, hive: str) -> HardState:
    """Return the state of the first member of a new hive."""
    log = Log.of(Snapshot(Position(1, 1), members=(member_id,)))
    return HardState(member_id, 0, "", log, hive)


def restore(
    hard_state: HardState, settings: RaftSettings, now: float, *, voter: bool = True
) -> Member:
    """Return the state of a member that starts with what is on its disk.

    Unless it is the only one with a vote, it neither votes nor campaigns for a while, because it
    does not know which leader it last followed.

    Args:
        hard_state: What is on its disk.
        settings: The hive's timers.
        now: The time by its own clock [s].
        voter: Whether it is willing to lead.
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


class Bootstrap:
    """Bootstraps a hive after a random number of heartbeats, unless somebody is heard.

    Meanwhile it announces the member by an AppendReply to nobody. The members of a hive answer
    that, even while they have no leader.

    Args:
        talker: Sends and waits.
        member: Id of the member.
        heartbeat: Time between two announcements [s].
        random: Keeps two members from bootstrapping at the same time.
        has_joined: Says whether the member belongs to a hive by now.
        begin: Begins a new hive; called once at most.
    """

    def __init__(
        self,
        talker: Talker,
        member: str,
        heartbeat: float,
        random: Random,
        has_joined: Callable[[], bool],
        begin: Callable[[], None],
    ) -> None:
        self._talker = talker
        self._member = member
        self._heartbeat = heartbeat
        self._left = random.randint(_MIN_SILENCE, _MAX_SILENCE)
        self._has_joined = has_joined
        self._begin = begin
        self._known = ""
        self._wait()

    def stop_for(self, hive: str) -> None:
        """Wait for a hive, one of whose members is heard, instead of bootstrapping another."""
        if not self._known:
            self._known = hive
            self._talker.warn(
                f"{name_of(self._member)} has an empty disk and hears members of hive {hive}, "
                "which has no leader at present. It waits for that hive and does not bootstrap "
                "another. If that hive cannot recover, stop its members, move their journals away "
                "and start all of them again"
            )

    def _wait(self) -> None:
        if self._has_joined():
            return
        if self._left == 0 and not self._known:
            self._begin()
            return
        self._left = max(self._left - 1, 0)
        self._talker.publish(BB_ACK, AppendReply(self._member, 0, 0, 0.0))
        self._talker.after(self._heartbeat, self._wait)


class Handover:
    """Posts the open tasks of a hive of one member to the hive that the member is going to join.

    It works like any operator's program: it posts a task again until the other hive's task list
    contains it, or until the task is rejected.

    Args:
        talker: Sends and listens.
        name: Of the member.
        to: Id of the other hive.
        records: The member's task list.
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
        self._subscriptions = (
            [
                talker.subscribe(SYNC, self._hear_list),
                talker.subscribe(TASK_STATE, self._hear_update),
            ]
            if self._open
            else []
        )

    @property
    def is_done(self) -> bool:
        """Whether every task has been answered."""
        return not self._open

    def post(self) -> None:
        """Post the open tasks if it is time; called at every heartbeat."""
        if self._beats % _REPOST_INTERVAL == 0:
            for task in self._open.values():
                self._talker.publish(NEW_TASK, task)
        self._beats += 1

    def end(self) -> None:
        """Stop listening."""
        for subscription in self._subscriptions:
            subscription.cancel()

    def _hear_list(self, known: TaskList) -> None:
        if known.hive == self._to:  # Its own hive's last list may still arrive.
            for record in known.records:
                self._open.pop(record.task.id, None)

    def _hear_update(self, update: TaskUpdate) -> None:
        if update.state is TaskState.REJECTED and self._open.pop(update.task_id, None) is not None:
            self._talker.warn(
                f"{self._name} cannot hand over {update.task_id}, which it had accepted: "
                f"{update.reason}"
            )
