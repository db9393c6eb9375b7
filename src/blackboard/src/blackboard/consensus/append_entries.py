# SPDX-License-Identifier: BSD-3-Clause
"""AppendEntries on both sides: each entry goes to each member once, unless it was lost.

A busy member answers late. Sending it the same entries again makes it busier, and if all are busy
the hive stalls (docs/decisions/083). So the leader sends an entry again only to a member that has
answered a later message without having the entry.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from blackboard.consensus.log import Log
from blackboard.consensus.member import name_of
from blackboard.consensus.messages import AppendEntries

if TYPE_CHECKING:
    from collections.abc import Collection

    from blackboard.consensus.log import Entry, Position, Snapshot
    from blackboard.consensus.member import Member, Step
    from blackboard.consensus.messages import Message

MAX_ENTRIES = 200
"""Entries in one message; the rest follows later."""

_OVERTAKING = 0.5
"""Messages of different topics overtake each other by less than this many heartbeats. So an entry
is lost if the answer to something sent that much later shows that the member does not have it."""


def send(
    member: Member,
    to: Collection[str],
    before: Position,
    entries: tuple[Entry, ...],
    now: float,
    snapshot: Snapshot | None = None,
) -> tuple[Member, AppendEntries]:
    """Send entries, and note that they are sent.

    Args:
        member: The leader.
        to: Ids of the receivers.
        before: Position of the entry before the first.
        entries: The first `MAX_ENTRIES` of them are sent.
        now: The time [s].
        snapshot: The state at `before`, for receivers that do not have it.
    """
    message = AppendEntries(
        member.epoch,
        member.id,
        before,
        entries[:MAX_ENTRIES],
        member.log.committed,
        now,
        snapshot,
        member.hive,
        tuple(map(name_of, to)),
    )
    peers = dict(member.peers)
    for each in to:
        if (peer := peers.get(each)) is not None:
            first = snapshot is not None or before.version <= peer.version
            sent_at = now if first else peer.sent_at
            peers[each] = replace(peer, sent=message.last_version, sent_at=sent_at)
    return member.evolve(peers=MappingProxyType(peers)), message


def send_missing(member: Member, now: float, *, learners: bool) -> Step:
    """Send what is in flight or committed to everyone who was not sent it, or who lost it.

    Args:
        member: The leader.
        now: The time [s].
        learners: Whether learners get it too, or voters only.
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
        if before is None:
            member, message = send(member, to, log.base.position, log.entries, now, log.base)
        else:
            member, message = send(member, to, before, log.since(before.version) or (), now)
        messages.append(message)
    return member, messages


def extend(log: Log, message: AppendEntries) -> Log | None:
    """Append the leader's entries to a follower's log.

    They replace entries that an earlier leader never got committed.

    Args:
        log: Of the follower.
        message: From the leader of the highest epoch that the follower has seen.

    Returns:
        The new log, or None if entries between the two are missing.
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
