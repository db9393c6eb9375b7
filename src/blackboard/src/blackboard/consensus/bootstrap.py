# SPDX-License-Identifier: BSD-3-Clause
"""The states with which members and hives start, and the handover with which a hive ends.

A blackboard node with a new disk bootstraps a hive if it hears nobody (docs/decisions/024). But it
may have lost its disk while it was cut off from a hive that goes on without it. So before it joins
that hive, it hands over the tasks it has accepted alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.journal import HardState
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member
from blackboard.domain.talker import NEW_TASK, SYNC, TASK_STATE
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Iterable
    from random import Random

    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.record import TaskRecord, TaskUpdate
    from blackboard.domain.settings import RaftSettings
    from blackboard.domain.talker import Subscription, Talker

_REPOST_INTERVAL = 5
"""Heartbeats until a task that nobody has answered is posted again."""


def new_id(random: Random) -> str:
    """Return a new id of a hive or of a disk."""
    return f"{random.getrandbits(32):08x}"


def new_member(name: str, random: Random, hive: str = "") -> HardState:
    """Return the state of a member with an empty disk; `hive` is the one it joins, if known."""
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
    """
    alone = hard_state.log.latest.members == (hard_state.member,)
    return Member(
        hard_state.member,
        settings,
        hard_state.log,
        hard_state.epoch,
        hard_state.vote,
        heard=float("-inf") if alone else now,
        loyal_until=float("-inf") if alone else now + settings.election,
        quiet_until=float("-inf") if alone else now + settings.election,
        version=hard_state.log.committed,
        hive=hard_state.hive,
        voter=voter,
    )


def hard_state_of(member: Member) -> HardState:
    """Return what a member has to have on disk."""
    return HardState(member.id, member.epoch, member.vote, member.log, member.hive)


class Handover:
    """Posts the open tasks of a hive of one member to the hive that the member is going to join.

    It works like any operator's program: it posts a task again until the other hive's task list
    contains it, or until the task is rejected.

    Args:
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
        self._subscriptions: list[Subscription] = []
        if self._open:
            self._subscriptions.append(talker.subscribe(SYNC, self._hear_list))
            self._subscriptions.append(talker.subscribe(TASK_STATE, self._hear_update))

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
