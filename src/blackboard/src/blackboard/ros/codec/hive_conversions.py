# SPDX-License-Identifier: BSD-3-Clause
"""The border between ROS messages and what the members of a hive tell each other."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import rospy
from std_msgs.msg import Header

import blackboard.msg as bb_msgs
from blackboard.consensus.log import Entry, Position, Snapshot
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, BallotKind, Heartbeat
from blackboard.domain import talker as topics
from blackboard.ros.codec.records import record_from_msg, record_to_msg
from blackboard.ros.codec.wire import Wire

if TYPE_CHECKING:
    from collections.abc import Mapping


def _header() -> Header:
    return Header(stamp=rospy.Time.now())


def _beat_to_msg(beat: Heartbeat) -> bb_msgs.BbBackup:
    return bb_msgs.BbBackup(
        header=_header(),
        epoch=beat.epoch,
        active=beat.leader,
        backup=beat.backup,
        members=list(beat.members),
        progress=beat.progress,
        version=beat.version,
        sent=beat.sent,
        robots=list(beat.heard),
        heard=list(beat.heard.values()),
        robot_lease=beat.robot_lease,
        hive=beat.hive,
    )


def _beat_from_msg(msg: bb_msgs.BbBackup) -> Heartbeat:
    return Heartbeat(
        epoch=msg.epoch,
        leader=msg.active,
        backup=msg.backup,
        members=tuple(msg.members),
        progress=msg.progress,
        version=msg.version,
        sent=msg.sent,
        heard=dict(zip(msg.robots, msg.heard, strict=True)),
        robot_lease=msg.robot_lease,
        hive=msg.hive,
    )


def _entry_to_msg(entry: Entry) -> bb_msgs.BbEntry:
    return bb_msgs.BbEntry(
        epoch=entry.epoch,
        version=entry.version,
        tasks=list(map(record_to_msg, entry.records)),
        changes_members=entry.members is not None,
        members=list(entry.members or ()),
        forgotten=list(entry.forgotten),
    )


def _entry_from_msg(msg: bb_msgs.BbEntry) -> Entry:
    members = tuple(msg.members) if msg.changes_members else None
    records = tuple(map(record_from_msg, msg.tasks))
    return Entry(msg.epoch, msg.version, records, members, tuple(msg.forgotten))


def _entries_to_msg(entries: AppendEntries) -> bb_msgs.BbEntries:
    snapshot = entries.snapshot
    return bb_msgs.BbEntries(
        header=_header(),
        epoch=entries.epoch,
        active=entries.leader,
        before_epoch=entries.before.epoch,
        before_version=entries.before.version,
        entries=list(map(_entry_to_msg, entries.entries)),
        committed=entries.committed,
        sent=entries.sent,
        whole=snapshot is not None,
        tasks=[record_to_msg(record) for record in snapshot.records.values()] if snapshot else [],
        members=list(snapshot.members) if snapshot else [],
        hive=entries.hive,
        earlier=snapshot.earlier if snapshot else 0,
    )


def _entries_from_msg(msg: bb_msgs.BbEntries) -> AppendEntries:
    before = Position(msg.before_epoch, msg.before_version)
    entries = tuple(map(_entry_from_msg, msg.entries))
    versions = [entry.version for entry in entries]
    if versions != list(range(before.version + 1, before.version + 1 + len(entries))):
        raise ValueError(f"changes {versions} do not follow version {before.version}")
    snapshot = None
    if msg.whole:
        records = {record.task.id: record for record in map(record_from_msg, msg.tasks)}
        snapshot = Snapshot(before, records, tuple(msg.members), msg.earlier)
    return AppendEntries(
        msg.epoch, msg.active, before, entries, msg.committed, msg.sent, snapshot, msg.hive
    )


def _ack_to_msg(ack: AppendReply) -> bb_msgs.BbAck:
    return bb_msgs.BbAck(
        _header(), ack.member, ack.epoch, ack.version, ack.echo, ack.hive, ack.voter
    )


def _ack_from_msg(msg: bb_msgs.BbAck) -> AppendReply:
    return AppendReply(msg.member, msg.epoch, msg.version, msg.echo, msg.hive, msg.stands_by)


def _ballot_to_msg(ballot: Ballot) -> bb_msgs.BbVote:
    return bb_msgs.BbVote(
        header=_header(),
        kind=ballot.kind,
        epoch=ballot.epoch,
        candidate=ballot.candidate,
        member=ballot.member,
        list_epoch=ballot.position.epoch,
        list_version=ballot.position.version,
        granted=ballot.granted,
        seen=ballot.seen,
        hive=ballot.hive,
    )


def _ballot_from_msg(msg: bb_msgs.BbVote) -> Ballot:
    return Ballot(
        kind=BallotKind(msg.kind),
        epoch=msg.epoch,
        candidate=msg.candidate,
        member=msg.member,
        position=Position(msg.list_epoch, msg.list_version),
        granted=msg.granted,
        seen=msg.seen,
        hive=msg.hive,
    )


HIVE_WIRES: Mapping[str, Wire] = MappingProxyType(
    {
        topics.BACKUP: Wire(bb_msgs.BbBackup, _beat_to_msg, _beat_from_msg),
        topics.BB_ENTRIES: Wire(bb_msgs.BbEntries, _entries_to_msg, _entries_from_msg),
        topics.BB_ACK: Wire(bb_msgs.BbAck, _ack_to_msg, _ack_from_msg),
        topics.BB_VOTE: Wire(bb_msgs.BbVote, _ballot_to_msg, _ballot_from_msg),
    }
)
"""How the messages between members are made and read."""
