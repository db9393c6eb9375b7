# SPDX-License-Identifier: BSD-3-Clause
"""When the active blackboard sends its changes, and to whom."""

from types import MappingProxyType

import pytest

from blackboard import active
from blackboard.consensus import Tick, Write, concerned, step
from blackboard.member import Member, Peer, Role
from blackboard.pose import Pose
from blackboard.record import TaskRecord
from blackboard.replication import Ack, Entries, Log, Position, Whole
from blackboard.settings import BackupSettings
from blackboard.task import Task, TaskType

VOTERS = ("blackboard#1", "robot1#1", "robot2#1")
LISTENERS = ("robot8#1", "robot9#1")
NOW = 100.0


class Active:
    """The blackboard node, active, with two members that vote and two that do not."""

    def __init__(self):
        others = (*VOTERS[1:], *LISTENERS)
        self.member = Member(
            VOTERS[0],
            BackupSettings(most_members=3),
            Log.of(Whole(Position(1, 1), members=VOTERS)),
            epoch=1,
            role=Role.ACTIVE,
            active="blackboard",
            peers=MappingProxyType({each: Peer(1, NOW, NOW) for each in others}),
            hive="hive1",
        )

    def do(self, event, now=NOW):
        """Return the changes that are sent after an event: their versions, and to whom they go."""
        self.member, said = step(self.member, event, now)
        return [
            ([entry.version for entry in each.entries], set(concerned(each, event, self.member)))
            for each in said
            if isinstance(each, Entries)
        ]

    def write(self, name):
        """Write a new task."""
        return self.do(Write((TaskRecord(Task(name, TaskType.GA, (Pose(1.0, 1.0),))),)))

    def hear(self, member, version):
        """Hear that a member has written down up to a version."""
        return self.do(Ack(member, 1, version, NOW, "hive1"))


@pytest.fixture
def blackboard():
    return Active()


def test_a_change_goes_at_once_to_those_who_vote(blackboard):
    assert blackboard.write("T1") == [([2], {"blackboard", "robot1", "robot2"})]


def test_changes_are_gathered_while_one_is_on_its_way_and_then_go_together(blackboard):
    blackboard.write("T1")
    assert blackboard.write("T2") == []
    assert blackboard.write("T3") == []

    assert [versions for versions, _ in blackboard.hear("robot1#1", 2)] == [[3, 4]]
    assert blackboard.hear("robot2#1", 2) == []
    assert blackboard.member.log.committed == 2


def test_once_all_is_committed_the_next_change_goes_at_once_again(blackboard):
    blackboard.write("T1")
    assert blackboard.hear("robot2#1", 2) == []

    assert [versions for versions, _ in blackboard.write("T2")] == [[3]]


def test_no_message_brings_more_changes_than_are_allowed(blackboard, monkeypatch):
    monkeypatch.setattr(active, "MOST_ENTRIES", 2)
    for number in range(4):
        blackboard.write(f"T{number}")

    assert [versions for versions, _ in blackboard.hear("robot1#1", 2)] == [[3, 4]]
    assert [versions for versions, _ in blackboard.hear("robot1#1", 4)] == [[5]]


def test_whoever_has_no_vote_is_sent_changes_with_the_heartbeat(blackboard):
    blackboard.write("T1")
    for voter in VOTERS[1:]:
        blackboard.hear(voter, 2)

    blackboard.do(Tick(0.0))
    assert blackboard.do(Tick(0.0)) == [([2], {"robot8", "robot9"})]


def test_what_was_lost_is_sent_again_to_those_who_lack_it(blackboard):
    blackboard.write("T1")
    blackboard.write("T2")
    for each in (*VOTERS[2:], *LISTENERS):
        blackboard.hear(each, 2)
    blackboard.do(Tick(0.0))
    for each in (*VOTERS[2:], *LISTENERS):
        blackboard.hear(each, 3)

    assert blackboard.do(Tick(0.0)) == [([2, 3], {"robot1"})]


def test_one_of_two_that_goes_on_alone_commits_what_was_on_its_way_to_the_other(blackboard):
    both = (VOTERS[0], VOTERS[1])
    log = Log.of(Whole(Position(1, 1), members=both))
    peers = MappingProxyType({VOTERS[1]: Peer(1, NOW, NOW)})
    blackboard.member = blackboard.member.but(log=log, peers=peers)
    blackboard.write("T1")

    blackboard.do(Tick(0.0), NOW + 1.0)
    blackboard.write("T2")

    assert blackboard.member.members == (VOTERS[0],)
    assert blackboard.member.log.committed == blackboard.member.log.position.version
