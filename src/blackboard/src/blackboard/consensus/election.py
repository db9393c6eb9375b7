# SPDX-License-Identifier: BSD-3-Clause
"""Leader election: Raft with pre-vote and a named successor, the backup.

A member that misses the leader first asks whether the others miss it too. Only when a majority
does, the member begins a new epoch, in which everybody has one vote. The backup that the leader
has named campaigns first, the others follow in the order of the members.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.consensus.leader import become_leader
from blackboard.consensus.member import Role, be_loyal, enter_epoch, is_majority, name_of
from blackboard.consensus.messages import Ballot, BallotKind

if TYPE_CHECKING:
    from blackboard.consensus.log import Position
    from blackboard.consensus.member import Member, Step


_LATER = 0.25
"""The others may have heard the leader's last message this many heartbeats later. A member that
asked them earlier would have to ask again."""


def campaign_if_due(member: Member, now: float, chance: float) -> Step:
    """Have a member that does not lead request pre-votes once its election timeout is over.

    `chance`, from 0 to 1, keeps two members that campaign together from doing so again.
    """
    earliest = _earliest_campaign(member)
    # Rank the members only once the timeout is over: this runs at every heartbeat.
    early = now < earliest or now < earliest + _stagger(member)
    if early or member.id not in member.members or not member.voter:
        return member, []
    member = member.evolve(
        role=Role.PRE_CANDIDATE,
        votes=frozenset([member.id]),
        retry=now + 2 * member.settings.heartbeat,
        jitter=chance,
    )
    if is_majority(member.votes, member.members):
        return _become_candidate(member, now)
    return member, [_request(member, BallotKind.PRE_VOTE, member.epoch + 1)]


def _earliest_campaign(member: Member) -> float:
    """Return when the first in rank campaigns unless it hears a leader [s].

    Silence has to last for the election timeout; a leader that is proved dead is replaced at once.
    """
    timeout = member.loyal_until + _LATER * member.settings.heartbeat
    due = timeout if member.died is None else min(member.died, timeout)
    return max(due, member.quiet_until, member.retry)


def _stagger(member: Member) -> float:
    """Return how much later than the first in rank this member campaigns [s]."""
    names = [name_of(each) for each in member.members]
    if member.backup in names:
        names.remove(member.backup)
        names.insert(0, member.backup)
    others = [name for name in names if name != member.leader]
    own = name_of(member.id)
    rank = others.index(own) if own in others else len(others)
    return (rank + member.jitter * (rank > 0)) * member.settings.stagger


def _become_candidate(member: Member, now: float) -> Step:
    member = enter_epoch(member, member.epoch + 1).evolve(
        role=Role.CANDIDATE, vote=member.id, votes=frozenset([member.id]), asked=now
    )
    request = _request(member, BallotKind.VOTE, member.epoch)
    if not is_majority(member.votes, member.members):
        return member, [request]
    member, messages = become_leader(member, now)
    return member, [request, *messages]


def _request(member: Member, kind: BallotKind, epoch: int) -> Ballot:
    position = member.log.position
    return Ballot(kind, epoch, member.id, member.id, position, seen=member.epoch, hive=member.hive)


def misses_leader(member: Member, candidate: str, now: float) -> bool:
    """Return whether a member has recently heard no leader other than the candidate."""
    if member.died is not None or name_of(candidate) == member.leader:
        return True
    return now >= member.loyal_until


def is_up_to_date(member: Member, position: Position) -> bool:
    """Return whether a candidate's log contains everything that this member's log contains."""
    return position >= member.log.position


def has_vote_for(member: Member, candidate: str) -> bool:
    """Return whether a member may vote for a candidate in its present epoch."""
    return member.vote in {"", candidate}


def is_vote_in_time(member: Member, now: float) -> bool:
    """Return whether a vote that arrives now still counts.

    A voter elects nobody else for a while after it voted. If its vote takes too long, that while
    may be over.
    """
    return now - member.asked <= member.settings.self_demotion


def handle_vote_request(member: Member, ballot: Ballot, now: float) -> Step:
    """Answer a request for a vote or pre-vote.

    A member that hears the leader ignores requests for votes and their epoch. So a member that
    was cut off and comes back does not depose the leader.
    """
    if ballot.candidate == member.id:
        return member, []
    willing = now >= member.quiet_until and misses_leader(member, ballot.candidate, now)
    if ballot.kind is BallotKind.PRE_VOTE:
        granted = (
            willing and ballot.epoch > member.epoch and is_up_to_date(member, ballot.position)
        )
        member = member.evolve(refused=None if granted else ballot)
        return member, [_reply(member, ballot, BallotKind.PRE_VOTE_REPLY, granted)]
    if not willing:
        return member, []
    if ballot.epoch > member.epoch:
        member = enter_epoch(member, ballot.epoch)
    granted = (
        ballot.epoch == member.epoch
        and has_vote_for(member, ballot.candidate)
        and is_up_to_date(member, ballot.position)
    )
    if granted:
        leader = name_of(ballot.candidate)
        member = member.evolve(vote=ballot.candidate, leader=leader, backup="", patience=0.0)
        member = be_loyal(member, now)
    return member, [_reply(member, ballot, BallotKind.VOTE_REPLY, granted)]


def learn_of_death(member: Member, now: float) -> Step:
    """Campaign if it is this member's turn, with the proof that the leader is dead.

    Members get that proof at different moments. So whoever asked earlier is answered again; it
    would not repeat its request for two heartbeats.
    """
    asked, member = member.refused, member.evolve(died=now, refused=None)
    if asked is None:
        return campaign_if_due(member, now, member.jitter)
    member, answers = handle_vote_request(member, asked, now)
    member, requests = campaign_if_due(member, now, member.jitter)
    return member, [*answers, *requests]


def _reply(member: Member, ballot: Ballot, kind: BallotKind, granted: bool) -> Ballot:
    return replace(
        ballot,
        kind=kind,
        member=member.id,
        position=member.log.position,
        granted=granted,
        seen=member.epoch,
    )


def handle_vote_reply(member: Member, ballot: Ballot, now: float) -> Step:
    """Count a vote or pre-vote; with a majority, become a candidate or the leader."""
    if ballot.candidate != member.id:
        return member, []
    if ballot.seen > member.epoch:
        return enter_epoch(member, ballot.seen), []
    if ballot.kind is BallotKind.PRE_VOTE_REPLY:
        expected, promote = (Role.PRE_CANDIDATE, member.epoch + 1), _become_candidate
    else:
        expected, promote = (Role.CANDIDATE, member.epoch), become_leader
    if not ballot.granted or (member.role, ballot.epoch) != expected:
        return member, []
    if member.role is Role.CANDIDATE and not is_vote_in_time(member, now):
        return member, []
    member = member.evolve(votes=member.votes | {ballot.member})
    return promote(member, now) if is_majority(member.votes, member.members) else (member, [])
