# SPDX-License-Identifier: BSD-3-Clause
"""The one function by which a member of the hive moves on: from state, event and time.

It sorts events to `election` and `leader`, and does what a follower does. Nothing here knows of
time, messages under way or disks, so a simulation can try every order of events.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.consensus import election, leader
from blackboard.consensus.append_entries import extend
from blackboard.consensus.lease import MAX_EPOCH
from blackboard.consensus.member import Role, adopt, follow, has_lease, name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, BallotKind, Heartbeat

if TYPE_CHECKING:
    from blackboard.consensus.election import Step
    from blackboard.consensus.member import Member
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Tick:
    """A heartbeat's time has passed; `chance` is drawn from 0 to 1."""

    chance: float


@dataclass(frozen=True, slots=True)
class Died:
    """The process of a member, active in an epoch, is proved dead."""

    member: str
    epoch: int


@dataclass(frozen=True, slots=True)
class Write:
    """The blackboard wants a change committed."""

    records: tuple[TaskRecord, ...]
    forgotten: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class LeaseCheck:
    """The blackboard is about to act."""


Event = Tick | Died | Write | LeaseCheck | Heartbeat | AppendEntries | AppendReply | Ballot


def step(member: Member, event: Event, now: float) -> Step:
    """Move a member on.

    Args:
        member: Its state.
        event: What happened.
        now: The time by the member's own clock [s].

    Returns:
        Its state afterwards, and the messages that it sends once the state is on disk.
    """
    if isinstance(event, Tick):
        said = _pass_time(member, event, now)
    elif isinstance(event, Write):
        said = leader.write(member, now, event.records, forgotten=event.forgotten)
    elif isinstance(event, LeaseCheck):
        lost = member.role is Role.LEADER and not has_lease(member, now)
        said = (leader.step_down(member, now) if lost else member), []
    elif isinstance(event, Died):
        said = _learn_of_death(member, event, now)
    elif member.epoch and event.epoch > member.epoch + MAX_EPOCH:
        said = member, []
    elif isinstance(event, Heartbeat):
        said = _hear_beat(member, event, now)
    elif isinstance(event, AppendEntries):
        said = _hear_entries(member, event, now)
    elif isinstance(event, AppendReply):
        said = _hear_ack(member, event, now)
    else:
        said = _hear_ballot(member, event, now)
    return said


def concerned(message: object, event: Event) -> tuple[str, ...] | None:
    """Return the names of the members that a message concerns; None means all.

    An acknowledgement concerns whom it answers: nobody else counts it. Changes concern those who
    lack them, see `sending`, and most heartbeats those who stand by.

    Args:
        message: What is said.
        event: After what.
    """
    if isinstance(message, AppendReply) and isinstance(event, Heartbeat | AppendEntries):
        return (name_of(event.leader),)
    return message.to if isinstance(message, AppendEntries | Heartbeat) else None


def _pass_time(member: Member, tick: Tick, now: float) -> Step:
    if member.role is Role.LEADER:
        return leader.keep_going(member, now)
    return _stand(member, now, tick.chance)


def _stand(member: Member, now: float, chance: float) -> Step:
    member, said = election.stand_if_due(member, now, chance)
    return _take_over_if_won(member, said, now)


def _take_over_if_won(member: Member, said: list[object], now: float) -> Step:
    if not election.has_won(member):
        return member, said
    member, more = leader.become_leader(member, now)
    return member, said + more


def _learn_of_death(member: Member, death: Died, now: float) -> Step:
    if (death.member, death.epoch) != (member.leader, member.epoch) or member.role is Role.LEADER:
        return member, []
    return _stand(member.but(died=now), now, member.jitter)


def _hear_beat(member: Member, beat: Heartbeat, now: float) -> Step:
    heard = _heed(member, beat.epoch, beat.leader, beat.hive, now)
    if heard is None:
        return member, _contradict(member, beat.epoch)
    log = heard.log.commit(min(beat.version, heard.version), heard.settings.kept_changes)
    heard = heard.but(backup=beat.backup, log=log)
    return heard, [_ack(heard, heard.version, beat.sent)]


def _hear_entries(member: Member, message: AppendEntries, now: float) -> Step:
    heard = _heed(member, message.epoch, name_of(message.leader), message.hive, now)
    if heard is None:
        return member, _contradict(member, message.epoch)
    log = extend(heard.log, message)
    if log is not None:
        version = max(heard.version, message.reaches)
        log = log.commit(min(message.committed, version), heard.settings.kept_changes)
        heard = heard.but(log=log, version=version)
    return heard, [_ack(heard, heard.version, message.sent)]


def _ack(member: Member, version: int, echo: float) -> AppendReply:
    return AppendReply(member.id, member.epoch, version, echo, member.hive, member.voter)


def _heed(member: Member, epoch: int, speaker: str, hive: str, now: float) -> Member | None:
    """Follow the active one of an epoch; None where it is of a lower one, or this very member.

    Who belongs to no hive yet belongs to that of the first active one that it hears.
    """
    if speaker == name_of(member.id) or epoch < member.epoch:
        return None
    if epoch > member.epoch:
        member = adopt(member, epoch)
    elif member.role is not Role.FOLLOWER:
        member = follow(member)
    return member.but(leader=speaker, heard=now, died=None, hive=member.hive or hive)


def _contradict(member: Member, epoch: int) -> list[object]:
    """Let an active one of a lower epoch know that its time is over."""
    return [_ack(member, 0, 0.0)] if epoch < member.epoch else []


def _hear_ack(member: Member, reply: AppendReply, now: float) -> Step:
    if member.role is not Role.LEADER:
        return member, []
    if reply.epoch > member.epoch:
        return adopt(leader.step_down(member, now), reply.epoch), []
    return leader.hear_reply(member, reply, now)


def _hear_ballot(member: Member, ballot: Ballot, now: float) -> Step:
    if ballot.kind in {BallotKind.PRE_VOTE_REPLY, BallotKind.VOTE_REPLY}:
        member, said = election.hear_answer(member, ballot, now)
        return _take_over_if_won(member, said, now)
    if member.role is Role.LEADER and has_lease(member, now):
        return member, []
    return election.hear_question(member, ballot, now)
