# SPDX-License-Identifier: BSD-3-Clause
"""The pure function that moves a member on: from its state, an event and the time.

It dispatches events to `election` and `leader`, and does what a follower does. It knows no clock,
network or disk, so a simulation can try every order of events.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from blackboard.consensus import election, leader
from blackboard.consensus.log import Log
from blackboard.consensus.member import (
    Role,
    be_loyal,
    become_follower,
    enter_epoch,
    has_lease,
    name_of,
    patience_of,
)
from blackboard.consensus.messages import (
    MAX_EPOCH_JUMP,
    AppendEntries,
    AppendReply,
    Ballot,
    BallotKind,
    Heartbeat,
)

if TYPE_CHECKING:
    from blackboard.consensus.member import Member, Step
    from blackboard.consensus.messages import Message
    from blackboard.domain.charger import Grant
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Tick:
    """A heartbeat period is over; `chance` is a random number from 0 to 1."""

    chance: float


@dataclass(frozen=True, slots=True)
class HalfTick:
    """Half a heartbeat period has passed since the leader's last `Tick`."""


@dataclass(frozen=True, slots=True)
class Died:
    """The process of the leader of an epoch is proved dead."""

    leader: str
    epoch: int


@dataclass(frozen=True, slots=True)
class Propose:
    """The blackboard wants a change committed."""

    records: tuple[TaskRecord, ...]
    forgotten: tuple[str, ...] = ()
    grants: tuple[Grant, ...] = ()


Event = Tick | HalfTick | Died | Propose | Heartbeat | AppendEntries | AppendReply | Ballot


def step(member: Member, event: Event, now: float) -> Step:
    """Return what a member becomes with an event, and what it sends; `now` is its clock [s]."""
    if isinstance(event, Tick | HalfTick):
        return _pass_time(member, event, now)
    if isinstance(event, Propose):
        records, forgotten = event.records, event.forgotten
        return leader.propose(member, now, records, forgotten=forgotten, grants=event.grants)
    if isinstance(event, Died):
        if member.role is not Role.LEADER and event == Died(member.leader, member.epoch):
            return election.learn_of_death(member, now)
    elif not member.epoch or event.epoch <= member.epoch + MAX_EPOCH_JUMP:
        return _receive(member, event, now)
    return member, []


def _pass_time(member: Member, event: Tick | HalfTick, now: float) -> Step:
    leads = member.role is Role.LEADER
    if isinstance(event, HalfTick):
        return leader.insist(member, now) if leads else (member, [])
    if leads:
        return leader.lead(member, now)
    return election.campaign_if_due(member, now, event.chance)


def _receive(member: Member, message: Message, now: float) -> Step:
    if isinstance(message, Heartbeat | AppendEntries):
        return _handle_leader(member, message, now)
    leads = member.role is Role.LEADER
    if isinstance(message, AppendReply):
        if leads and message.epoch > member.epoch:
            return enter_epoch(leader.step_down(member, now), message.epoch), []
        return leader.handle_append_reply(member, message, now) if leads else (member, [])
    if message.kind in {BallotKind.PRE_VOTE_REPLY, BallotKind.VOTE_REPLY}:
        return election.handle_vote_reply(member, message, now)
    if leads and has_lease(member, now):
        return member, []
    return election.handle_vote_request(member, message, now)


def _handle_leader(member: Member, message: Heartbeat | AppendEntries, now: float) -> Step:
    sender = name_of(message.leader)
    follower = _follow(member, message.epoch, sender, message.hive)
    if follower is None:
        # Tell a leader of a lower epoch that it has been replaced.
        answers = message.epoch < member.epoch
        return member, [_reply(member, 0, 0.0, sender)] if answers else []
    kept = member.settings.kept_changes
    if isinstance(message, Heartbeat):
        log = follower.log.commit(min(message.version, follower.version), kept)
        follower = follower.evolve(backup=message.backup, log=log, patience=message.patience)
    elif (extended := extend(follower.log, message)) is not None:
        version = max(follower.version, message.last_version)
        log = extended.commit(min(message.committed, version), kept)
        follower = follower.evolve(log=log, version=version)
    follower = be_loyal(follower, now)
    return follower, [_reply(follower, follower.version, message.sent, sender)]


def _reply(member: Member, version: int, echo: float, to: str) -> AppendReply:
    return AppendReply(
        member.id,
        member.epoch,
        version,
        echo,
        hive=member.hive,
        voter=member.voter,
        members=len(member.members),
        promise=patience_of(member),
        to=(to,),
    )


def _follow(member: Member, epoch: int, leader: str, hive: str) -> Member | None:
    """Follow the leader of an epoch; None if the epoch is over, or the leader is this member.

    A member that belongs to no hive joins the hive of the first leader it hears.
    """
    if leader == name_of(member.id) or epoch < member.epoch:
        return None
    if epoch > member.epoch:
        member = enter_epoch(member, epoch)
    elif member.role is not Role.FOLLOWER:
        member = become_follower(member)
    return member.evolve(leader=leader, hive=member.hive or hive)


def extend(log: Log, message: AppendEntries) -> Log | None:
    """Append the leader's entries to a follower's log.

    They replace entries that an earlier leader never got committed. Returns None if entries
    between the log and the message are missing.
    """
    before = message.before
    if before.version > log.committed and log.at(before.version) != before:
        return Log.of(message.snapshot, message.entries) if message.snapshot is not None else None
    new = [
        entry
        for entry in message.entries
        if entry.version > log.committed and log.at(entry.version) != entry.position
    ]
    if not new:
        return log
    kept = log.entries[: new[0].version - log.base.position.version - 1]
    if len(kept) < len(log.entries):
        return Log.of(log.base, (*kept, *new), log.committed)
    return replace(log, entries=(*kept, *new), latest=log.latest.after(new))
