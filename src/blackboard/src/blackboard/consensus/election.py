# SPDX-License-Identifier: BSD-3-Clause
"""How the hive finds a new active blackboard: Raft's election with pre-vote, and a named backup.

Whoever misses the active one asks first whether the others miss it too. Only when a majority does
is a new epoch begun, in which every member has one vote. The backup named by the active one
stands first, the others by their place in the list.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.member import Role, adopt, is_majority, name_of
from blackboard.consensus.messages import Ballot, BallotKind

if TYPE_CHECKING:
    from blackboard.consensus.log import Position
    from blackboard.consensus.member import Member

Step = tuple["Member", list[object]]
"""What becomes of a member, and what it says."""


def stands_at(member: Member) -> float:
    """Return when a follower stands if it hears nothing until then [s].

    Silence takes the whole election time; a death that is proved takes none of it.
    """
    return _may_stand_at(member) + _delay(member)


def _may_stand_at(member: Member) -> float:
    """Return when a follower would stand if it were the first in turn [s]."""
    silent_since = member.heard + member.settings.election
    since = silent_since if member.died is None else min(member.died, silent_since)
    return max(since, member.quiet_until, member.retry)


def _delay(member: Member) -> float:
    """Return by how much the backup stands before this member, and each before the next [s]."""
    names = [name_of(each) for each in member.members]
    if member.backup in names:
        names.remove(member.backup)
        names.insert(0, member.backup)
    others = [name for name in names if name != member.leader]
    own = name_of(member.id)
    rank = others.index(own) if own in others else len(others)
    return (rank + member.jitter * (rank > 0)) * member.settings.stagger


def stand_if_due(member: Member, now: float, chance: float) -> Step:
    """Let a member that is not active stand when its time has come.

    Args:
        member: It.
        now: The time [s].
        chance: From 0 to 1, so that two that stand together do not do so again.
    """
    # The first is looked at every heartbeat, and its turn only when that is over.
    early = now < _may_stand_at(member) or now < stands_at(member)
    if early or member.id not in member.members or not member.voter:
        return member, []
    member = member.but(
        role=Role.PRE_CANDIDATE,
        votes=frozenset([member.id]),
        retry=now + 2 * member.settings.heartbeat,
        jitter=chance,
    )
    if is_majority(member.votes, member.members):
        return _become_candidate(member, now)
    return member, [_ask(member, BallotKind.PRE_VOTE, member.epoch + 1)]


def _become_candidate(member: Member, now: float) -> Step:
    member = adopt(member, member.epoch + 1).but(
        role=Role.CANDIDATE,
        vote=member.id,
        votes=frozenset([member.id]),
        asked=now,
    )
    return member, [_ask(member, BallotKind.VOTE, member.epoch)]


def _ask(member: Member, kind: BallotKind, epoch: int) -> Ballot:
    position = member.log.position
    return Ballot(kind, epoch, member.id, member.id, position, seen=member.epoch, hive=member.hive)


def misses_leader(member: Member, candidate: str, now: float) -> bool:
    """Return whether no active one, other than the candidate, has been heard of late."""
    if member.died is not None or name_of(candidate) == member.leader:
        return True
    return now - member.heard >= member.settings.election


def is_up_to_date(member: Member, position: Position) -> bool:
    """Return whether a candidate's list lacks nothing that this member holds."""
    return position >= member.log.position


def has_vote_for(member: Member, candidate: str) -> bool:
    """Return whether a member may vote for a candidate in its present epoch."""
    return member.vote in {"", candidate}


def hear_question(member: Member, ballot: Ballot, now: float) -> Step:
    """Answer a member that asks for a vote, or whether it would get one.

    A member that hears the active one answers nothing and enters no higher epoch, so a member
    that was cut off and comes back disturbs nobody.
    """
    if ballot.candidate == member.id:
        return member, []
    willing = now >= member.quiet_until and misses_leader(member, ballot.candidate, now)
    if ballot.kind is BallotKind.PRE_VOTE:
        granted = (
            willing and ballot.epoch > member.epoch and is_up_to_date(member, ballot.position)
        )
        return member, [_answer(member, ballot, BallotKind.PRE_VOTE_REPLY, granted)]
    if not willing:
        return member, []
    if ballot.epoch > member.epoch:
        member = adopt(member, ballot.epoch)
    granted = (
        ballot.epoch == member.epoch
        and has_vote_for(member, ballot.candidate)
        and is_up_to_date(member, ballot.position)
    )
    if granted:
        member = member.but(
            vote=ballot.candidate,
            leader=name_of(ballot.candidate),
            backup="",
            heard=now,
            died=None,
        )
    return member, [_answer(member, ballot, BallotKind.VOTE_REPLY, granted)]


def _answer(member: Member, ballot: Ballot, kind: BallotKind, granted: bool) -> Ballot:
    return replace(
        ballot,
        kind=kind,
        member=member.id,
        position=member.log.position,
        granted=granted,
        seen=member.epoch,
    )


def hear_answer(member: Member, ballot: Ballot, now: float) -> Step:
    """Count a vote; `Role.CANDIDATE` with a majority is the caller's sign that it has won.

    A vote that took too long counts no more: who gave it may elect another soon, because its
    promise began long ago.
    """
    if ballot.candidate != member.id:
        return member, []
    if ballot.seen > member.epoch:
        return adopt(member, ballot.seen), []
    if not ballot.granted:
        return member, []
    before = member.role is Role.PRE_CANDIDATE and ballot.kind is BallotKind.PRE_VOTE_REPLY
    if before and ballot.epoch == member.epoch + 1:
        member = member.but(votes=member.votes | {ballot.member})
        if is_majority(member.votes, member.members):
            return _become_candidate(member, now)
    elif (
        member.role is Role.CANDIDATE
        and ballot.kind is BallotKind.VOTE_REPLY
        and ballot.epoch == member.epoch
        and now - member.asked <= member.settings.self_demotion
    ):
        member = member.but(votes=member.votes | {ballot.member})
    return member, []


def has_won(member: Member) -> bool:
    """Return whether a majority has voted for a candidate."""
    return member.role is Role.CANDIDATE and is_majority(member.votes, member.members)
