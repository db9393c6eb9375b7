# SPDX-License-Identifier: BSD-3-Clause
"""What the active blackboard does for the hive: replicate, count, and keep the list of members.

It commits a change once a majority of the members has it on disk, and steps down by itself when no
majority has followed it of late: by then the others may elect another.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.consensus.append_entries import send, send_what_is_missing
from blackboard.consensus.log import Entry, Log, committed_version
from blackboard.consensus.member import (
    Peer,
    Role,
    follow,
    followed_since,
    has_lease,
    majority_of,
    name_of,
)
from blackboard.consensus.messages import Heartbeat

if TYPE_CHECKING:
    from blackboard.consensus.election import Step
    from blackboard.consensus.member import Member
    from blackboard.consensus.messages import AppendReply
    from blackboard.domain.record import TaskRecord

BEATS_ASIDE = 5
"""Whoever does not stand by hears only one in so many heartbeats, and changes only with it: of a
large fleet these are nearly all, and to hear one costs a robot more than anything else at rest."""

MIN_MEMBERS = 3
"""With fewer, no majority is left when one is gone, so failover is off."""


def become_leader(member: Member, now: float) -> Step:
    """Take over: say so, and write an empty change, which commits all before it."""
    known = Peer(heard=now)
    peers = {each: known for each in member.members if each != member.id}
    peers |= {each: Peer(echo=member.asked, heard=now) for each in member.votes - {member.id}}
    member = member.but(
        role=Role.LEADER,
        leader=name_of(member.id),
        backup="",
        died=None,
        votes=frozenset(),
        peers=MappingProxyType(peers),
        in_flight=0,
    )
    member, first = beat(member, now)
    member, more = write(member, now)
    return member, [first, *more]


def write(
    member: Member,
    now: float,
    records: tuple[TaskRecord, ...] = (),
    members: tuple[str, ...] | None = None,
    forgotten: tuple[str, ...] = (),
) -> Step:
    """Add a change to the list and have the others write it down too.

    While one is on its way to them, those after it are gathered, and go together when a majority
    has written it down.
    """
    log = member.log
    entry = Entry(member.epoch, log.position.version + 1, records, members, forgotten)
    is_alone = member.in_flight <= log.committed
    member = member.but(log=log.append(entry))
    if not is_alone:  # it may leave so few members that a majority has what is on its way
        return _go_on(advance(member), now)
    member, message = send(member, member.members, log.position, (entry,), now)
    return advance(member.but(in_flight=entry.version)), [message]


def _go_on(member: Member, now: float) -> Step:
    """Send what was gathered, if nothing is on its way any more."""
    log = member.log
    before, gathered = log.at(log.committed), log.since(log.committed)
    if member.in_flight > log.committed or before is None or not gathered:
        return member, []
    member, message = send(member, member.members, before, gathered, now)
    return member.but(in_flight=message.reaches), [message]


def advance(member: Member) -> Member:
    """Commit what a majority holds."""
    nobody = Peer()
    held = [
        member.log.position.version
        if each == member.id
        else member.peers.get(each, nobody).version
        for each in member.members
    ]
    version = committed_version(member.log, member.epoch, held, majority_of(member.members))
    if version == member.log.committed:
        return member
    return member.but(log=member.log.commit(version, member.settings.kept_changes))


def hear_reply(member: Member, reply: AppendReply, now: float) -> Step:
    """Note what another member has on disk, and that it follows."""
    if reply.epoch != member.epoch or reply.member == member.id:
        return member, []
    known = member.peers.get(reply.member, Peer())
    version = min(reply.version, member.log.position.version)
    if reply.echo <= known.echo:
        version = max(version, known.version)  # otherwise it has been started again
    echo = max(known.echo, min(reply.echo, now))
    gets_on = version > known.version
    # What it has not answered yet was sent after that.
    sent_at = max(known.sent_at, echo) if gets_on else known.sent_at
    peer = Peer(version, echo, now, reply.voter, known.sent, sent_at)
    member = member.but(peers=MappingProxyType({**member.peers, reply.member: peer}))
    return _go_on(advance(member), now) if gets_on else (member, [])


def keep_going(member: Member, now: float) -> Step:
    """Do what is due at every heartbeat."""
    change = next_members(member, now)
    said: list[object] = []
    changed = member
    if change is not None:
        changed, said = write(member, now, members=change)
    # Who goes on alone when the other one of two falls silent is the majority only afterwards.
    if not has_lease(changed, now):
        return step_down(member, now), []
    member = changed
    member, beaten = beat(member, now)
    member, missing = send_what_is_missing(member, now, aside=beaten.to is None)
    return member, [*said, beaten, *missing]


def step_down(member: Member, now: float) -> Member:
    """Become a follower that knows of no active one."""
    silent_since = min(now, followed_since(member, now))
    return follow(member).but(leader="", backup="", heard=silent_since, died=None)


def beat(member: Member, now: float) -> tuple[Member, Heartbeat]:
    """Say that it is there; every time to those who stand by, and now and then to the others."""
    member = member.but(backup=name_backup(member, now), progress=member.progress + 1)
    names = tuple(map(name_of, member.members))
    beat_ = Heartbeat(
        member.epoch,
        name_of(member.id),
        member.backup,
        names,
        member.progress,
        member.log.committed,
        now,
        hive=member.hive,
        to=_voters(member) if member.progress % BEATS_ASIDE else None,
    )
    return member, beat_


def _voters(member: Member) -> tuple[str, ...] | None:
    """Return the names of those who do, or None where all do that are known."""
    by_id = dict.fromkeys(member.members, True)
    by_id |= {each: peer.voter for each, peer in member.peers.items()}
    return None if all(by_id.values()) else tuple(name_of(each) for each in by_id if by_id[each])


def name_backup(member: Member, now: float) -> str:
    """Choose who stands first: the same as before while it follows, else the next that does."""
    if len(member.members) < MIN_MEMBERS:
        return ""
    able = [name_of(each) for each in member.members if _follows(member, each, now)]
    return member.backup if member.backup in able else next(iter(able), "")


def _follows(member: Member, other: str, now: float) -> bool:
    """Return whether another member has been heard of late and holds all that is committed."""
    peer = member.peers.get(other)
    if peer is None:
        return False
    heard = now - peer.heard <= member.settings.self_demotion
    return heard and peer.version >= member.log.committed


def may_change_members(log: Log, epoch: int) -> bool:
    """Return whether the list of members may be changed now.

    One change has to be committed before the next begins, and one of the active one's own epoch
    before the first, so that any majority of the old list meets any of the new one. Lists of one
    or two are the exception: the active one is in each of their majorities.
    """
    position = log.at(log.committed)
    if position is None or position.epoch != epoch:
        return False
    small = MIN_MEMBERS - 1
    both_small = len(log.latest.members) <= small and len(log.stable.members) <= small
    return log.members_are_settled or both_small


def next_members(member: Member, now: float) -> tuple[str, ...] | None:
    """Return the list of members after the next change that is due, or None where none is."""
    if not may_change_members(member.log, member.epoch):
        return None
    members = member.members
    for each in members:
        if each != member.id and _is_gone(member, each, now):
            return tuple(other for other in members if other != each)
    names = set(map(name_of, members))
    if len(members) < member.settings.most_members:
        for each in sorted(member.peers):
            voter = member.peers[each].voter
            if voter and name_of(each) not in names and _follows(member, each, now):
                return (*members, each)
    return None


def _is_gone(member: Member, other: str, now: float) -> bool:
    """Return whether another member has left the hive, or would carry the blackboard no more."""
    peer = member.peers.get(other, Peer())
    settings = member.settings
    # Of two, both would be needed. The other cannot be elected without this one, so this one need
    # not wait before it goes on alone, and must not wait until it would have to step down itself.
    few = len(member.members) < MIN_MEMBERS
    patience = settings.self_demotion / 2 if few else settings.member_timeout
    if now - peer.heard > patience or not peer.voter:
        return True
    name = name_of(other)
    return any(
        name_of(each) == name and each != other and seen.heard > peer.heard
        for each, seen in member.peers.items()
    )
