# SPDX-License-Identifier: BSD-3-Clause
"""What the leader does: replicates entries, commits them and maintains the list of members.

An entry is committed once a majority of the members has it on disk. A leader that no majority has
answered recently steps down, because the others may elect another by then.

Each entry goes to each member once, unless it was lost. A busy member answers late. Sending it the
same entries again makes it busier, and if all are busy the hive stalls (docs/decisions/070). So
the leader sends an entry again only to a member that answers a later message without having it.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.consensus.log import Entry, Log, committed_version
from blackboard.consensus.member import (
    UNKNOWN_PEER,
    Contacts,
    Peer,
    Role,
    become_follower,
    has_lease,
    last_majority_contact,
    lease_of,
    majority_of,
    name_of,
    patience_of,
)
from blackboard.consensus.messages import AppendEntries, Heartbeat

if TYPE_CHECKING:
    from collections.abc import Collection

    from blackboard.consensus.log import Position
    from blackboard.consensus.member import Member, Step
    from blackboard.consensus.messages import AppendReply, Message
    from blackboard.domain.charger import Grant
    from blackboard.domain.record import TaskRecord

LEARNER_INTERVAL = 5
"""Learners hear one heartbeat in so many, and get entries only with it. Nearly all robots of a
large fleet are learners, and receiving heartbeats is what costs an idle robot the most."""

MIN_MEMBERS = 3
"""With fewer members, the loss of one leaves no majority, so failover is off."""

MAX_ENTRIES = 200
"""Entries in one message; the rest follows later."""

_OVERTAKING = 0.5
"""Messages of different topics overtake each other by less than this many heartbeats. So an entry
is lost if the answer to something sent that much later shows that the member does not have it."""


_MARGIN = 3.0
"""The members wait this many times as long as a majority's last answer has been old of late. With
30 % of the messages lost, three members had no takeover in ten hours (docs/benchmarks.md)."""

_PERIOD, _FIRST_PERIOD = 60.0, 5.0
"""How far back "of late" goes at least; a new leader, which knows nothing yet, asks for all the
patience there is until the first period is over [s]."""


def become_leader(member: Member, now: float) -> Step:
    """Announce the new leader and append an empty entry, which commits everything before it."""
    known = Peer(heard=now)
    peers = {each: known for each in member.members if each != member.id}
    until = member.asked + lease_of(member.settings, member.settings.election)
    voted = Peer(echo=member.asked, until=until, heard=now)
    peers |= dict.fromkeys(member.votes - {member.id}, voted)
    member = member.evolve(
        role=Role.LEADER,
        leader=name_of(member.id),
        backup="",
        died=None,
        votes=frozenset(),
        peers=MappingProxyType(peers),
        in_flight=0,
        contacts=Contacts(member.settings.election, ends=now + _FIRST_PERIOD),
    )
    member, announcement = _heartbeat(member, now)
    member, messages = propose(member, now)
    return member, [announcement, *messages]


def propose(
    member: Member,
    now: float,
    records: tuple[TaskRecord, ...] = (),
    members: tuple[str, ...] | None = None,
    forgotten: tuple[str, ...] = (),
    grants: tuple[Grant, ...] = (),
) -> Step:
    """Append an entry to the log and replicate it.

    While an entry is in flight, later ones wait; they go out together once it is committed.
    """
    log = member.log
    version = log.position.version + 1
    entry = Entry(member.epoch, version, records, members, forgotten, grants)
    is_alone = member.in_flight <= log.committed
    member = member.evolve(log=log.append(entry))
    if not is_alone:  # A shorter list of members may commit what is in flight.
        return _send_waiting(advance_commit(member), now)
    member, message = _send(member, member.members, log.position, now)
    return advance_commit(member.evolve(in_flight=entry.version)), [message]


def _send_waiting(member: Member, now: float) -> Step:
    """Send the entries that wait, unless one is still in flight."""
    log = member.log
    if member.in_flight > log.committed or log.position.version == log.committed:
        return member, []
    member, message = _send(member, member.members, log.at(log.committed), now)
    return member.evolve(in_flight=message.last_version), [message]


def advance_commit(member: Member) -> Member:
    """Commit the entries that a majority holds."""
    held = [
        member.log.position.version
        if each == member.id
        else member.peers.get(each, UNKNOWN_PEER).version
        for each in member.members
    ]
    version = committed_version(member.log, member.epoch, held, majority_of(member.members))
    if version == member.log.committed:
        return member
    return member.evolve(log=member.log.commit(version, member.settings.kept_changes))


def handle_append_reply(member: Member, reply: AppendReply, now: float) -> Step:
    """Note how much of the log another member has on disk, and that it follows."""
    if reply.epoch != member.epoch or reply.member == member.id:
        return member, []
    known = member.peers.get(reply.member, UNKNOWN_PEER)
    version = min(reply.version, member.log.position.version)
    if reply.echo <= known.echo:  # A later answer with a lower version comes after a restart.
        version = max(version, known.version)
    answered = min(reply.echo, now)
    echo = max(known.echo, answered)
    until = max(known.until, answered + lease_of(member.settings, reply.promise))
    advances = version > known.version
    # What the peer has not answered yet was sent after what it answers now.
    sent_at = max(known.sent_at, echo) if advances else known.sent_at
    peer = Peer(version, echo, until, now, reply.voter, known.sent, sent_at)
    member = member.evolve(peers=MappingProxyType({**member.peers, reply.member: peer}))
    return _send_waiting(advance_commit(member), now) if advances else (member, [])


def lead(member: Member, now: float) -> Step:
    """Do what is due at every heartbeat: change members, announce, resend; or step down."""
    member = changed = _observe(member, now)
    messages: list[Message] = []
    if (members := next_members(member, now)) is not None:
        changed, messages = propose(member, now, members=members)
    # A leader that drops the other of two members is a majority only after the change.
    if not has_lease(changed, now):
        return step_down(member, now), []
    member, heartbeat = _heartbeat(changed, now)
    member, missing = _send_missing(member, now, learners=heartbeat.to is None)
    return member, [*messages, heartbeat, *missing]


def insist(member: Member, now: float) -> Step:
    """Send the last heartbeat again if no majority has answered it yet."""
    member = _observe(member, now)
    if last_majority_contact(member, now) >= member.beat or not has_lease(member, now):
        return member, []
    member, heartbeat = _heartbeat(member.evolve(progress=member.progress - 1), now)
    return member, [heartbeat]


def _observe(member: Member, now: float) -> Member:
    """Note how old a majority's last answer is, and ask for patience accordingly.

    Half of the members of a hive of two cannot elect another leader, so they need not hurry.
    """
    settings, age = member.settings, now - last_majority_contact(member, now)
    contacts = member.contacts
    if now >= contacts.ends:
        contacts = Contacts(contacts.now, ends=now + _PERIOD)
    contacts = replace(contacts, now=max(contacts.now, age))
    hurries = len(member.members) >= MIN_MEMBERS
    patience = _MARGIN * contacts.oldest if hurries else settings.election
    return member.evolve(contacts=contacts, patience=patience)


def _send(
    member: Member, to: Collection[str], before: Position | None, now: float
) -> tuple[Member, AppendEntries]:
    """Send the entries after a position, and note that they are sent.

    If there is no such position, the log does not reach that far back: send the snapshot too.
    """
    log = member.log
    start = log.base.position if before is None else before
    message = AppendEntries(
        member.epoch,
        member.id,
        start,
        (log.since(start.version) or ())[:MAX_ENTRIES],
        log.committed,
        now,
        log.base if before is None else None,
        member.hive,
        tuple(map(name_of, to)),
    )
    peers = dict(member.peers)
    for each in to:
        if (peer := peers.get(each)) is not None:
            first = before is None or before.version <= peer.version
            sent_at = now if first else peer.sent_at
            peers[each] = replace(peer, sent=message.last_version, sent_at=sent_at)
    return member.evolve(peers=MappingProxyType(peers)), message


def _send_missing(member: Member, now: float, *, learners: bool) -> Step:
    """Send what is in flight or committed to voters that were not sent it, or that lost it.

    With `learners`, send it to learners too.
    """
    log = member.log
    recently = now - member.settings.self_demotion
    overtaking = _OVERTAKING * member.settings.heartbeat
    lacking = defaultdict(list)
    for each, peer in member.peers.items():
        is_lost = peer.echo > peer.sent_at + overtaking
        held = peer.version if is_lost else max(peer.version, peer.sent)
        is_due = (learners or peer.voter) and peer.heard >= recently
        if is_due and held < max(member.in_flight, log.committed):
            lacking[log.at(held)].append(each)
    messages: list[Message] = []
    for before, to in lacking.items():
        member, message = _send(member, to, before, now)
        messages.append(message)
    return member, messages


def step_down(member: Member, now: float) -> Member:
    """Become a follower that knows no leader."""
    silent_since = min(now, last_majority_contact(member, now))
    return become_follower(member).evolve(
        leader="",
        backup="",
        heard=silent_since,
        loyal_until=silent_since + patience_of(member),
        died=None,
    )


def _heartbeat(member: Member, now: float) -> tuple[Member, Heartbeat]:
    """Return the next heartbeat: always for the voters, now and then for the learners too."""
    backup, progress = name_backup(member, now), member.progress + 1
    member = member.evolve(backup=backup, progress=progress, beat=now)
    return member, Heartbeat(
        member.epoch,
        name_of(member.id),
        member.backup,
        tuple(map(name_of, member.members)),
        member.progress,
        member.log.committed,
        now,
        hive=member.hive,
        patience=patience_of(member),
        to=_voters(member) if member.progress % LEARNER_INTERVAL else None,
    )


def _voters(member: Member) -> tuple[str, ...] | None:
    """Return the names of the voters, or None if nobody known is a learner."""
    is_voter = dict.fromkeys(member.members, True)
    is_voter |= {each: peer.voter for each, peer in member.peers.items()}
    voters = tuple(name_of(each) for each in is_voter if is_voter[each])
    return None if len(voters) == len(is_voter) else voters


def name_backup(member: Member, now: float) -> str:
    """Choose the backup: the present one while it keeps up, else the next that does."""
    if len(member.members) < MIN_MEMBERS:
        return ""
    able = [name_of(each) for each in member.members if _keeps_up(member, each, now)]
    return member.backup if member.backup in able else next(iter(able), "")


def _keeps_up(member: Member, other: str, now: float) -> bool:
    """Return whether another member was heard recently and holds everything that is committed."""
    peer = member.peers.get(other)
    if peer is None:
        return False
    heard = now - peer.heard <= member.settings.self_demotion
    return heard and peer.version >= member.log.committed


def may_change_members(log: Log, epoch: int) -> bool:
    """Return whether the list of members may change now.

    Any majority of the old list has to overlap with any of the new one. So the leader commits an
    entry of its own epoch before the first change, and each change before the next. Lists of one
    or two members are an exception: the leader is in each of their majorities.
    """
    position = log.at(log.committed)
    if position is None or position.epoch != epoch:
        return False
    both_small = max(len(log.latest.members), len(log.stable.members)) < MIN_MEMBERS
    return log.members_are_settled or both_small


def next_members(member: Member, now: float) -> tuple[str, ...] | None:
    """Return the list of members after the next change that is due, or None if none is due."""
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
            if voter and name_of(each) not in names and _keeps_up(member, each, now):
                return (*members, each)
    return None


def _is_gone(member: Member, other: str, now: float) -> bool:
    """Return whether another member has left the hive, lost its disk or become a learner."""
    peer = member.peers.get(other, UNKNOWN_PEER)
    settings = member.settings
    # A majority of two is both. The other cannot be elected without this one, so this one may go
    # on alone early, and has to do so before it would step down.
    few = len(member.members) < MIN_MEMBERS
    timeout = settings.self_demotion / 2 if few else settings.member_timeout
    if now - peer.heard > timeout or not peer.voter:
        return True
    name = name_of(other)
    return any(
        name_of(each) == name and each != other and seen.heard > peer.heard
        for each, seen in member.peers.items()
    )
