# SPDX-License-Identifier: BSD-3-Clause
"""What the active blackboard sends to whom: each change once to each member, unless it is lost.

A busy member answers late. To send it again what it has not answered makes it busier still, and
where all are busy the hive comes to a stand (docs/decisions/083-sent-once.md). So a member is sent
a change again only when it has answered something later without it.
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

    from blackboard.consensus.election import Step
    from blackboard.consensus.log import Entry, Position, Snapshot
    from blackboard.consensus.member import Member, Peer

MAX_ENTRIES = 200
"""Changes in one message; the rest follows later."""

_LATER = 0.5
"""An answer to what was sent so many heartbeats later, without the change, shows that it is lost:
messages of different topics may overtake each other by less."""


def send(
    member: Member,
    to: Collection[str],
    before: Position,
    entries: tuple[Entry, ...],
    now: float,
    snapshot: Snapshot | None = None,
) -> tuple[Member, AppendEntries]:
    """Send changes, and note that they are sent.

    Args:
        member: Who sends, the active one.
        to: Ids of those who get them.
        before: What the changes follow.
        entries: The changes; of too many the first.
        now: The time [s].
        whole: The list at `before`, for those who do not have that.
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
            answers_first = snapshot is not None or before.version <= peer.version
            sent_at = now if answers_first else peer.sent_at
            peers[each] = replace(peer, sent=message.reaches, sent_at=sent_at)
    return member.but(peers=MappingProxyType(peers)), message


def send_what_is_missing(member: Member, now: float, *, aside: bool) -> Step:
    """Send what is on its way or committed to all who have not been sent it, or have lost it.

    Args:
        member: Who sends, the active one.
        now: The time [s].
        aside: Whether those are sent it as well who do not stand by.
    """
    log = member.log
    recently = now - member.settings.self_demotion
    lacking = defaultdict(list)
    for each, peer in member.peers.items():
        has_lost = _has_lost(peer, member.settings.heartbeat)
        known = peer.version if has_lost else max(peer.version, peer.sent)
        is_due = (aside or peer.voter) and peer.heard >= recently
        if is_due and known < max(member.in_flight, log.committed):
            lacking[log.at(known)].append(each)
    said: list[object] = []
    for before, to in lacking.items():
        if before is None:
            member, message = send(member, to, log.base.position, log.entries, now, log.base)
        else:
            entries = log.since(before.version) or ()
            member, message = send(member, to, before, entries, now)
        said.append(message)
    return member, said


def _has_lost(peer: Peer, heartbeat: float) -> bool:
    return peer.echo > peer.sent_at + _LATER * heartbeat


def extend(log: Log, message: AppendEntries) -> Log | None:
    """Write down what the active blackboard sent.

    Changes that an earlier active blackboard never got committed give way to those of this one.

    Args:
        log: What this member holds.
        message: From the active blackboard of the highest epoch this member has seen.

    Returns:
        The longer log, or None where something between the two is missing.
    """
    before = message.before
    known = before.version <= log.committed or log.at(before.version) == before
    if not known and message.snapshot is None:
        return None
    if not known and message.snapshot is not None:
        return Log.of(message.snapshot, message.entries)
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
