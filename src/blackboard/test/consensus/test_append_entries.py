# SPDX-License-Identifier: BSD-3-Clause
"""When the active blackboard sends its changes, and to whom."""

from types import MappingProxyType

import pytest

from blackboard.consensus import append_entries
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Peer, Role
from blackboard.consensus.messages import AppendEntries, AppendReply
from blackboard.consensus.step import Tick, Write, concerned, step
from blackboard.domain.record import TaskRecord
from blackboard.domain.settings import RaftSettings
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose

VOTERS = ("blackboard#1", "robot1#1", "robot2#1")
LISTENERS = ("robot8#1", "robot9#1")
NOW = 100.0


class Active:
    """The blackboard node, active, with two members that vote and two that do not."""

    def __init__(self):
        others = (*VOTERS[1:], *LISTENERS)
        self.member = Member(
            VOTERS[0],
            RaftSettings(most_members=3),
            Log.of(Snapshot(Position(1, 1), members=VOTERS)),
            epoch=1,
            role=Role.LEADER,
            leader="blackboard",
            peers=MappingProxyType({each: Peer(1, NOW, NOW) for each in others}),
            hive="hive1",
        )

    def do(self, event, now=NOW):
        """Return the changes that are sent after an event: their versions, and to whom they go."""
        self.member, said = step(self.member, event, now)
        return [
            ([entry.version for entry in each.entries], set(concerned(each, event)))
            for each in said
            if isinstance(each, AppendEntries)
        ]

    def write(self, name, now=NOW):
        """Write a new task."""
        return self.do(Write((TaskRecord(Task(name, TaskType.GA, (Pose(1.0, 1.0),))),)), now)

    def hear(self, member, version, echo=NOW):
        """Hear that a member has written down up to a version, answering what was sent then."""
        return self.do(AppendReply(member, 1, version, echo, "hive1"), max(echo, NOW))


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
    monkeypatch.setattr(append_entries, "MAX_ENTRIES", 2)
    for number in range(4):
        blackboard.write(f"T{number}")

    assert [versions for versions, _ in blackboard.hear("robot1#1", 2)] == [[3, 4]]
    assert [versions for versions, _ in blackboard.hear("robot1#1", 4)] == [[5]]


def test_whoever_has_no_vote_is_sent_changes_with_the_heartbeat(blackboard):
    blackboard.write("T1")

    assert blackboard.do(Tick(0.0)) == [([2], {"robot8", "robot9"})]


def test_nobody_is_sent_a_change_again_for_answering_late(blackboard):
    blackboard.write("T1")
    blackboard.do(Tick(0.0))
    blackboard.hear("robot1#1", 2)
    blackboard.write("T2")

    assert blackboard.do(Tick(0.0), NOW + 1.0) == [([3], {"robot8", "robot9"})]


def test_what_was_lost_is_sent_again_to_whoever_has_answered_something_later_without_it(
    blackboard,
):
    blackboard.write("T1")
    blackboard.do(Tick(0.0))
    blackboard.hear("robot2#1", 2)
    later = NOW + blackboard.member.settings.heartbeat
    for each in ("robot1#1", "robot8#1"):
        blackboard.hear(each, 1, later)

    assert blackboard.do(Tick(0.0), later) == [([2], {"robot1", "robot8"})]
    assert blackboard.do(Tick(0.0), later) == []


def test_whoever_is_always_one_change_behind_has_lost_nothing(blackboard):
    for number in range(8):
        now = NOW + 0.1 * number
        blackboard.write(f"T{number}", now)
        version = blackboard.member.log.position.version
        for each in (*VOTERS[2:], *LISTENERS):
            blackboard.hear(each, version, now)
        blackboard.hear("robot1#1", version - 1, now)

        assert blackboard.do(Tick(0.0), now) == []


def test_what_was_lost_is_sent_again_while_other_changes_follow_all_the_time(blackboard):
    sent = []
    for number in range(8):
        now = NOW + 0.1 * number
        sent += blackboard.write(f"T{number}", now)
        version = blackboard.member.log.position.version
        blackboard.hear("robot2#1", version, now)
        blackboard.hear("robot1#1", 1, now)
        sent += blackboard.do(Tick(0.0), now)

    assert any(versions[0] == 2 and to == {"robot1"} for versions, to in sent)


def test_whoever_is_started_again_is_sent_what_it_no_longer_knows_to_be_committed(blackboard):
    blackboard.write("T1")
    blackboard.do(Tick(0.0))
    for each in (*VOTERS[1:], *LISTENERS):
        blackboard.hear(each, 2)
    later = NOW + blackboard.member.settings.heartbeat
    blackboard.hear("robot1#1", 1, later)

    assert blackboard.do(Tick(0.0), later) == [([2], {"robot1"})]


def test_an_answer_that_comes_late_changes_nothing(blackboard):
    blackboard.write("T1")
    blackboard.do(Tick(0.0))
    for each in (*VOTERS[1:], *LISTENERS):
        blackboard.hear(each, 2)
    blackboard.hear("robot1#1", 1, NOW - 0.1)

    assert blackboard.do(Tick(0.0), NOW + 1.0) == []


def test_whoever_is_far_behind_is_sent_the_whole_list_and_nobody_else(blackboard):
    for number in range(200):
        blackboard.write(f"T{number}")
        for each in (*VOTERS[1:], LISTENERS[0]):
            blackboard.hear(each, blackboard.member.log.position.version)

    ((versions, to),) = blackboard.do(Tick(0.0), NOW + 0.1)

    assert versions[0] > 2
    assert to == {"robot9"}


def test_one_of_two_that_goes_on_alone_commits_what_was_on_its_way_to_the_other(blackboard):
    both = (VOTERS[0], VOTERS[1])
    log = Log.of(Snapshot(Position(1, 1), members=both))
    peers = MappingProxyType({VOTERS[1]: Peer(1, NOW, NOW)})
    blackboard.member = blackboard.member.but(log=log, peers=peers)
    blackboard.write("T1")

    blackboard.do(Tick(0.0), NOW + 1.0)
    blackboard.write("T2")

    assert blackboard.member.members == (VOTERS[0],)
    assert blackboard.member.log.committed == blackboard.member.log.position.version
