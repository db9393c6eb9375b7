# SPDX-License-Identifier: BSD-3-Clause
"""What a member ignores: other hives, and blackboards of an epoch that is over.

Every hive has a random id, which its members put into their messages to each other and to robots.
No message passes from one hive to another. If two hives hear each other, the one with fewer
members pauses; with as many, the one that has committed less (docs/decisions/024). Members of a
hive that a person has recovered as another one join that.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, Protocol

from blackboard.consensus.bootstrap import Handover, new_member
from blackboard.consensus.member import Role, name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Heartbeat, Message
from blackboard.consensus.recovery import succeeds
from blackboard.domain.talker import BB_ACK, SYNC
from hive_common.map_id import NO_MAP, MapId

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from blackboard.consensus.journal import HardState
    from blackboard.consensus.member import Member
    from blackboard.consensus.task_list import TaskList
    from blackboard.domain.talker import Talker


class _Hive(NamedTuple):
    """What is known of a hive. Of two that hear each other, the one that compares greater goes on.

    A founder without robots is as large as a hive that has lost all members but its leader. That
    one has committed more, unless it is as young.
    """

    size: float  # members; infinite if a person has recovered this hive as that one
    version: int  # of its task list
    id: str


class HiveFilter(Protocol):
    """The member beside a robot: says whom the robot obeys, and what the hive has committed."""

    @property
    def hive(self) -> str:
        """The id of the robot's hive; empty while it belongs to none."""

    @property
    def leader(self) -> tuple[str, ...] | None:
        """Name of the leader; None if unknown."""

    @property
    def carriers(self) -> tuple[str, ...] | None:
        """Names of the leader and of the backup; None if unknown."""

    @property
    def leaders_map(self) -> MapId:
        """The map that the leader uses; no map while that is unknown."""

    def obeys(self, hive: str, epoch: int) -> bool:
        """Return whether the robot obeys the blackboard of a hive and an epoch."""

    def follow(self, hear: Callable[[TaskList], None]) -> None:
        """Pass on the committed task list soon after every change."""

    def show(self) -> None:
        """Pass on the list soon although nothing has changed."""


class NoFilter:
    """Obeys everybody, and takes the list from `bb_sync`: no member is beside the robot."""

    hive = ""

    def __init__(self, talker: Talker) -> None:
        self._talker = talker
        self.leader: tuple[str, ...] | None = None
        self.carriers: tuple[str, ...] | None = None
        self.leaders_map = NO_MAP

    def obeys(self, _hive: str, _epoch: int) -> bool:
        """Return True."""
        return True

    def follow(self, hear: Callable[[TaskList], None]) -> None:
        """Pass on every list that the blackboard publishes."""
        self._talker.subscribe(SYNC, hear)

    def show(self) -> None:
        """Do nothing: the blackboard publishes the list again when a report is repeated."""


class MemberFilter:
    """Keeps other hives' messages out, and decides which of two hives pauses.

    Args:
        name: Of the member.
        timeout: A larger hive that was not heard for so long is gone [s].
        patience: This hive pauses for so long at most for a larger one that has no leader, and
            leaves its own after so long without a leader if a person has recovered that [s].
        bootstraps: Whether this member bootstraps a hive if it hears none.

    Attributes:
        known_hive: Id of a hive heard while this member belonged to none and was to bootstrap one.
    """

    def __init__(
        self, talker: Talker, name: str, timeout: float, patience: float, *, bootstraps: bool
    ) -> None:
        self.known_hive = ""
        self._talker = talker
        self._name = name
        self._timeout = timeout
        self._patience = patience
        self._told_of: dict[str, tuple[float, float]] = {}
        self._committed: dict[str, int] = {}  # by the other hive, as its leaders have said
        self._larger: _Hive | None = None
        self._larger_heard = -math.inf  # when
        self._own_size = 0
        self._own_version = 0
        self._handover: Handover | None = None
        self._warned: set[str] = set()
        self._needless: set[str] = set()
        self._bootstraps = bootstraps

    def accepts(self, message: Message, own: Member) -> bool:
        """Return whether this member handles a message; note what it tells of other hives.

        A member without a hive joins the hive of the first leader it hears.
        """
        if not own.hive:
            if isinstance(message, Heartbeat | AppendEntries):
                return True
            if message.hive and self._bootstraps and not self.known_hive:
                self.known_hive = message.hive
                self._talker.warn(
                    f"{self._name} has an empty disk and hears members of hive {message.hive}, "
                    "which has no leader at present. It waits for that hive and does not "
                    "bootstrap another. If too many of that hive's members are gone for good, "
                    "have it go on without them: hive recover --force-members"
                )
            return False
        if message.hive == own.hive:
            if isinstance(message, Heartbeat):
                self._own_size, self._own_version = len(message.members), message.version
            return not isinstance(message, AppendReply) or own.role is Role.LEADER
        if message.hive and isinstance(message, Heartbeat | AppendReply):
            self._hear_other(message, own)
        elif isinstance(message, AppendReply):
            # Somebody is about to bootstrap a hive.
            self._tell_of(own, name_of(message.member), message.echo)
        return False

    @property
    def larger_hive(self) -> str:
        """Id of the hive for which this one pauses now; empty if it does not."""
        if self._larger is None:
            return ""
        is_there = self._talker.now() - self._larger_heard < self._timeout
        return self._larger.id if is_there else ""

    def pauses(self, own: Member) -> bool:
        """Return whether the hive pauses for a larger one; if so, prepare to join that.

        Only a member without a vote may join, or the only member of a hive in which no robot has a
        task; and every member of a hive that was recovered as the larger one.
        """
        if self._larger is not None and not self._is_larger(self._larger, own):
            self._larger = None  # this hive has grown since, or the other one has lost members
        larger = self.larger_hive
        recovered = succeeds(larger, own.hive) and larger not in self._needless
        if not larger:
            self._end_handover()
        elif self._handover is None and (_may_leave(own) or recovered):
            alone = own.members == (own.id,) and not recovered
            records = own.log.latest.records.values() if alone else ()
            self._handover = Handover(self._talker, self._name, larger, records)
        return bool(larger)

    def join(self, random: Random) -> HardState | None:
        """Hand tasks over to the larger hive; called at every heartbeat while this one pauses.

        Returns the state with which the member starts in the larger hive; None until that hive has
        all tasks, and for a member that may not join.
        """
        if self._handover is None:
            return None
        self._handover.post()
        if not self._handover.is_done:
            return None
        hive = self.larger_hive
        self._end_handover()
        self._larger, self._own_version = None, 0
        return new_member(self._name, random, hive)

    def obeys(self, hive: str, epoch: int, own: Member) -> bool:
        """Return whether a blackboard is of this hive and its epoch is not over."""
        if hive != own.hive:
            return False
        kind = f"epoch {epoch}"
        if epoch < own.epoch and kind not in self._warned:
            self._warned.add(kind)
            self._talker.warn(
                f"{name_of(own.id)} ignores the blackboard of epoch {epoch}, because epoch "
                f"{own.epoch} has begun"
            )
        return epoch >= own.epoch

    def _end_handover(self) -> None:
        if self._handover is not None:
            self._handover.end()
        self._handover = None

    def _compare(self, message: Heartbeat | AppendReply, own: Member) -> None:
        """Find out which of two hives pauses, tell the other if it does, and say so once.

        A hive without a leader pauses the smaller one too, for a while: each of its members
        answers the heartbeats that it hears from there.
        """
        other, now = message.hive, self._talker.now()
        theirs = _hive_of(message)
        pauses = self._is_larger(theirs, own)
        if isinstance(message, Heartbeat):
            self._told_of.pop(other, None)
            self._committed[other] = max(message.version, self._committed.get(other, 0))
        elif message.version < self._committed.get(other, 0):
            return  # it may have missed that its hive has become smaller
        elif own.role is not Role.LEADER or not now - self._timeout <= message.echo <= now:
            return  # it answers none of this leader's heartbeats
        elif self._told_for(other, now) > self._patience:
            return  # it may never have a leader again
        if pauses or (self._larger is not None and self._larger.id == other):
            self._larger, self._larger_heard = theirs, now
        if not pauses and isinstance(message, Heartbeat):
            self._tell_of(own, message.leader, message.sent)
        verdict = f"{other} {'goes on' if pauses else 'pauses'}"
        if verdict in self._warned:
            return
        self._warned.add(verdict)
        mine = ", ".join(map(name_of, own.members)) or "nobody yet"
        if not pauses:
            then = "the other hive pauses"
        elif _may_leave(own):
            then = "its own hive gives way, so it joins the other"
        else:
            then = (
                "its own hive gives way and pauses while it hears the other. To have a member "
                "join the other hive, stop it, move its journal away and start it again; then "
                "post again what the other list lacks"
            )
        self._talker.warn(
            f"{name_of(own.id)} belongs to hive {own.hive} ({mine}) and hears hive {other} "
            f"({_described(message)}); {then}"
        )

    def _hear_other(self, message: Heartbeat | AppendReply, own: Member) -> None:
        """Take in what a member of another hive says."""
        if not self._is_recovered(own, message.hive):
            self._compare(message, own)
        elif isinstance(message, Heartbeat):
            self._leave(own, message.hive)

    def _is_recovered(self, own: Member, other: str) -> bool:
        """Return whether another hive is what a person has made of this one, which has no leader.

        False for ever if this hive has had a leader beside it: a majority was there.
        """
        if not succeeds(other, own.hive):
            return False
        led = own.leader and self._talker.now() - own.heard <= self._timeout
        if led or own.role is Role.LEADER:
            self._needless.add(other)
        return other not in self._needless

    def _leave(self, own: Member, other: str) -> None:
        """Prepare to join the hive as which this one was recovered, and say what is left behind.

        Another leader may still be elected, so this waits as long as for any hive without one.
        """
        now = self._talker.now()
        if now - own.heard <= self._patience:
            return
        self._larger, self._larger_heard = _Hive(math.inf, 0, other), now
        if other in self._warned:
            return
        self._warned.add(other)
        records = own.log.latest.records.values()
        left = [record.task.id for record in records if not record.state.is_terminal]
        told = "had no open tasks"
        if left:
            told = f"had the open tasks {', '.join(left)}; post again what the other list lacks"
        self._talker.warn(
            f"{name_of(own.id)} leaves hive {own.hive}, which has no leader and was recovered as "
            f"{other}, and joins that as a new member. Its own list {told}"
        )

    def _told_for(self, other: str, now: float) -> float:
        """Return for how long a hive without a leader has been heard, since it was last silent."""
        first, last = self._told_of.get(other, (now, now))
        if now - last > self._patience:
            first = now
        self._told_of[other] = first, now
        return now - first

    def _is_larger(self, other: _Hive, own: Member) -> bool:
        """Return whether another hive, rather than this one, goes on when the two meet."""
        version = max(self._own_version, own.log.committed)
        return other > _Hive(self._size_of(own), version, own.hive)

    def _size_of(self, own: Member) -> int:
        """Return how many members this member's hive has."""
        return len(own.members) if own.id in own.members else self._own_size

    def _tell_of(self, own: Member, name: str, echo: float) -> None:
        """Tell a member of a smaller hive, or of none, that there is this one.

        `echo` is when it sent what this answers, by its own clock [s].
        """
        answer = AppendReply(
            own.id,
            own.epoch,
            version=own.log.position.version,
            echo=echo,
            hive=own.hive,
            voter=own.voter,
            members=self._size_of(own),
            to=(name,),
        )
        self._talker.publish(BB_ACK, answer, answer.to)


def _hive_of(message: Heartbeat | AppendReply) -> _Hive:
    """Return what the sender says of its hive."""
    members = message.members
    size = len(members) if isinstance(members, tuple) else members
    return _Hive(size, message.version, message.hive)


def _described(message: Heartbeat | AppendReply) -> str:
    """Return the sender's hive in words."""
    if isinstance(message, Heartbeat):
        return f"{', '.join(message.members)}, led by {message.leader}"
    return f"{message.members} members, according to {name_of(message.member)}"


def _may_leave(own: Member) -> bool:
    """Return whether a member may join another hive: nobody else counts on its disk.

    Robots without a vote may be at tasks of a hive that has no other member left. The other hive
    may have tasks with the same ids, and would have them begun beside those.
    """
    if own.members == (own.id,):
        return not any(record.is_held for record in own.log.latest.records.values())
    return own.id not in own.members
