# SPDX-License-Identifier: BSD-3-Clause
"""Members that would not carry the blackboard: they hold the list, and have no vote."""

from random import Random
from types import MappingProxyType

import pytest

from blackboard.consensus import election, leader
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Peer, Role
from blackboard.consensus.messages import AppendReply
from blackboard.consensus.node import RaftNode
from blackboard.consensus.step import Tick, Write, concerned, step
from blackboard.domain.record import TaskRecord
from blackboard.domain.settings import RaftSettings
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.network import Network, NetworkTalker

VOTERS = ("blackboard#1", "robot1#1")
NOW = 100.0


def member(role=Role.LEADER, **fields):
    """Return the blackboard's member of a hive of two that vote."""
    log = Log.of(Snapshot(Position(1, 1), members=VOTERS))
    return Member(VOTERS[0], RaftSettings(), log, epoch=1, role=role, hive="hive1", **fields)


def boss_of(**voter):
    """Return the active member that has heard others of late, and whether they stand by."""
    peers = {f"{name}#1": Peer(1, NOW, NOW, each) for name, each in voter.items()}
    return member(leader="blackboard", peers=MappingProxyType(peers))


def test_who_does_not_stand_by_gets_no_vote():
    boss = boss_of(robot1=True, robot2=False, robot3=True)

    assert leader.next_members(boss, NOW) == (*VOTERS, "robot3#1")


def test_who_stands_by_no_more_loses_its_vote():
    assert leader.next_members(boss_of(robot1=False), NOW) == VOTERS[:1]


def test_the_active_one_learns_from_acknowledgements_who_stands_by():
    boss, _ = step(boss_of(robot1=True), AppendReply("robot2#1", 1, 1, NOW, "hive1", False), NOW)

    assert not boss.peers["robot2#1"].voter


def told(boss, beats):
    """Return whom some heartbeats in a row concern, each with the changes that go with it."""
    heard = []
    for number in range(beats):
        boss, said = step(boss, Tick(0.0), NOW + 0.2 * number)
        heard.append([concerned(each, Tick(0.0)) for each in said])
    return heard


def test_who_does_not_stand_by_hears_one_heartbeat_in_five_and_changes_with_it():
    boss = boss_of(robot1=True, robot2=False).but(settings=RaftSettings(most_members=2))
    boss, _ = step(boss, Write((TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 1.0),))),)), NOW)

    assert told(boss, 5) == [[("blackboard", "robot1")]] * 4 + [[None, ("robot2",)]]


def test_where_all_stand_by_all_hear_every_heartbeat():
    assert told(boss_of(robot1=True), 5) == [[None]] * 5


def test_everyone_hears_at_once_who_has_become_active():
    candidate = member(Role.CANDIDATE, votes=frozenset(VOTERS)).but(progress=1)

    _, said = leader.become_leader(candidate, NOW)

    assert concerned(said[0], Tick(0.0)) is None


@pytest.mark.parametrize("voter", [True, False])
def test_who_has_a_vote_from_before_stands_only_if_it_stands_by(voter):
    follower = member(Role.FOLLOWER, heard=NOW - 60.0, voter=voter)

    _, said = election.stand_if_due(follower, NOW, 0.0)

    assert bool(said) == voter


@pytest.mark.parametrize(
    ("voter", "topics"),
    [
        (True, {BACKUP, BB_ENTRIES, BB_VOTE, BB_ACK}),
        (False, {BACKUP, BB_ENTRIES}),
    ],
)
def test_who_does_not_stand_by_listens_to_the_active_one_only(voter, topics):
    heard = set()

    class Ears(NetworkTalker):
        def subscribe(self, topic, *_):
            heard.add(topic)

    talker = Ears(Network(), "robot1")
    settings = RaftSettings()
    disk = MemoryJournal()
    RaftNode(talker, "robot1", settings, disk, Random(0), voter=voter).start()

    assert heard == topics
