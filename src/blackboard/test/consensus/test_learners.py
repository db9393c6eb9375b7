# SPDX-License-Identifier: BSD-3-Clause
"""Learners: members that hold the log, but neither vote nor lead."""

from random import Random
from types import MappingProxyType

import pytest

from blackboard.consensus import election, leader
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Peer, Role
from blackboard.consensus.messages import AppendReply
from blackboard.consensus.node import RaftNode
from blackboard.consensus.step import Propose, Tick, step
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


def leader_of(**voter):
    """Return a leader that has heard others recently, and whether they are voters."""
    peers = {f"{name}#1": Peer(1, NOW, NOW + 5.0, NOW, each) for name, each in voter.items()}
    return member(leader="blackboard", peers=MappingProxyType(peers))


def test_a_learner_gets_no_vote():
    head = leader_of(robot1=True, robot2=False, robot3=True)

    assert leader.next_members(head, NOW) == (*VOTERS, "robot3#1")


def test_a_voter_that_becomes_a_learner_loses_its_vote():
    assert leader.next_members(leader_of(robot1=False), NOW) == VOTERS[:1]


def test_the_leader_sees_from_replies_who_is_a_learner():
    head, _ = step(leader_of(robot1=True), AppendReply("robot2#1", 1, 1, NOW, "hive1", False), NOW)

    assert not head.peers["robot2#1"].voter


def told(head, beats):
    """Return the receivers of some heartbeats in a row, and of the entries sent with them."""
    heard = []
    for number in range(beats):
        head, messages = step(head, Tick(0.0), NOW + 0.2 * number)
        heard.append([each.to for each in messages])
    return heard


def test_a_learner_hears_one_heartbeat_in_five_and_gets_entries_with_it():
    head = leader_of(robot1=True, robot2=False).evolve(settings=RaftSettings(most_members=2))
    head, _ = step(head, Propose((TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 1.0),))),)), NOW)

    assert told(head, 5) == [[("blackboard", "robot1")]] * 4 + [[None, ("robot2",)]]


def test_without_learners_all_hear_every_heartbeat():
    assert told(leader_of(robot1=True), 5) == [[None]] * 5


def test_everyone_hears_at_once_of_a_new_leader():
    candidate = member(Role.CANDIDATE, votes=frozenset(VOTERS)).evolve(progress=1)

    _, messages = leader.become_leader(candidate, NOW)

    assert messages[0].to is None


@pytest.mark.parametrize("voter", [True, False])
def test_a_member_campaigns_only_if_it_is_a_voter(voter):
    follower = member(Role.FOLLOWER, heard=NOW - 60.0, voter=voter)

    _, messages = election.campaign_if_due(follower, NOW, 0.0)

    assert bool(messages) == voter


@pytest.mark.parametrize(
    ("voter", "topics"),
    [
        (True, {BACKUP, BB_ENTRIES, BB_VOTE, BB_ACK}),
        (False, {BACKUP, BB_ENTRIES}),
    ],
)
def test_a_learner_listens_to_the_leader_only(voter, topics):
    heard = set()

    class Ears(NetworkTalker):
        def subscribe(self, topic, *_):
            heard.add(topic)

    talker = Ears(Network(), "robot1")
    settings = RaftSettings()
    disk = MemoryJournal()
    RaftNode(talker, "robot1", settings, disk, Random(0), voter=voter).start()

    assert heard == topics
