# SPDX-License-Identifier: BSD-3-Clause
"""When the leader sends entries, and to whom."""

from types import MappingProxyType

import pytest

from blackboard.consensus import leader
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.member import Member, Peer, Role
from blackboard.consensus.messages import AppendEntries, AppendReply, Heartbeat
from blackboard.consensus.step import Propose, Tick, step
from blackboard.domain.record import TaskRecord
from blackboard.domain.settings import RaftSettings
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose

VOTERS = ("blackboard#1", "robot1#1", "robot2#1")
LEARNERS = ("robot8#1", "robot9#1")
NOW = 100.0


class Leader:
    """The blackboard node as the leader of two other voters and two learners."""

    def __init__(self):
        others = (*VOTERS[1:], *LEARNERS)
        self.member = Member(
            VOTERS[0],
            RaftSettings(most_members=3),
            Log.of(Snapshot(Position(1, 1), members=VOTERS)),
            epoch=1,
            role=Role.LEADER,
            leader="blackboard",
            peers=MappingProxyType({each: Peer(1, NOW, NOW + 5.0, NOW) for each in others}),
            hive="hive1",
        )

    def do(self, event, now=NOW):
        """Return the entries that are sent after an event: their versions, and the receivers."""
        self.member, messages = step(self.member, event, now)
        return [
            ([entry.version for entry in each.entries], set(each.to))
            for each in messages
            if isinstance(each, AppendEntries)
        ]

    def propose(self, name, now=NOW):
        """Propose a new task."""
        return self.do(Propose((TaskRecord(Task(name, TaskType.GA, (Pose(1.0, 1.0),))),)), now)

    def hear(self, member, version, echo=NOW):
        """Hear that a member holds the log up to a version, answering what was sent at `echo`."""
        return self.do(AppendReply(member, 1, version, echo, "hive1"), max(echo, NOW))


@pytest.fixture
def blackboard():
    return Leader()


def test_an_entry_goes_at_once_to_the_voters(blackboard):
    assert blackboard.propose("T1") == [([2], {"blackboard", "robot1", "robot2"})]


def test_entries_wait_while_one_is_in_flight_and_then_go_together(blackboard):
    blackboard.propose("T1")
    assert blackboard.propose("T2") == []
    assert blackboard.propose("T3") == []

    assert [versions for versions, _ in blackboard.hear("robot1#1", 2)] == [[3, 4]]
    assert blackboard.hear("robot2#1", 2) == []
    assert blackboard.member.log.committed == 2


def test_once_all_is_committed_the_next_entry_goes_at_once_again(blackboard):
    blackboard.propose("T1")
    assert blackboard.hear("robot2#1", 2) == []

    assert [versions for versions, _ in blackboard.propose("T2")] == [[3]]


def test_no_message_has_more_entries_than_allowed(blackboard, monkeypatch):
    monkeypatch.setattr(leader, "MAX_ENTRIES", 2)
    for number in range(4):
        blackboard.propose(f"T{number}")

    assert [versions for versions, _ in blackboard.hear("robot1#1", 2)] == [[3, 4]]
    assert [versions for versions, _ in blackboard.hear("robot1#1", 4)] == [[5]]


def test_learners_are_sent_entries_with_the_heartbeat(blackboard):
    blackboard.propose("T1")

    assert blackboard.do(Tick(0.0)) == [([2], {"robot8", "robot9"})]


def test_a_late_answer_causes_no_resending(blackboard):
    blackboard.propose("T1")
    blackboard.do(Tick(0.0))
    blackboard.hear("robot1#1", 2)
    blackboard.propose("T2")

    assert blackboard.do(Tick(0.0), NOW + 1.0) == [([3], {"robot8", "robot9"})]


def test_a_lost_entry_is_sent_again_to_members_that_answer_something_later_without_it(
    blackboard,
):
    blackboard.propose("T1")
    blackboard.do(Tick(0.0))
    blackboard.hear("robot2#1", 2)
    later = NOW + blackboard.member.settings.heartbeat
    for each in ("robot1#1", "robot8#1"):
        blackboard.hear(each, 1, later)

    assert blackboard.do(Tick(0.0), later) == [([2], {"robot1", "robot8"})]
    assert blackboard.do(Tick(0.0), later) == []


def test_a_member_that_is_always_one_entry_behind_has_lost_nothing(blackboard):
    for number in range(8):
        now = NOW + 0.1 * number
        blackboard.propose(f"T{number}", now)
        version = blackboard.member.log.position.version
        for each in (*VOTERS[2:], *LEARNERS):
            blackboard.hear(each, version, now)
        blackboard.hear("robot1#1", version - 1, now)

        assert blackboard.do(Tick(0.0), now) == []


def test_a_lost_entry_is_sent_again_while_others_follow_all_the_time(blackboard):
    sent = []
    for number in range(8):
        now = NOW + 0.1 * number
        sent += blackboard.propose(f"T{number}", now)
        version = blackboard.member.log.position.version
        blackboard.hear("robot2#1", version, now)
        blackboard.hear("robot1#1", 1, now)
        sent += blackboard.do(Tick(0.0), now)

    assert any(versions[0] == 2 and to == {"robot1"} for versions, to in sent)


def test_a_restarted_member_is_sent_what_it_no_longer_knows_to_be_committed(blackboard):
    blackboard.propose("T1")
    blackboard.do(Tick(0.0))
    for each in (*VOTERS[1:], *LEARNERS):
        blackboard.hear(each, 2)
    later = NOW + blackboard.member.settings.heartbeat
    blackboard.hear("robot1#1", 1, later)

    assert blackboard.do(Tick(0.0), later) == [([2], {"robot1"})]


def test_an_answer_that_arrives_late_changes_nothing(blackboard):
    blackboard.propose("T1")
    blackboard.do(Tick(0.0))
    for each in (*VOTERS[1:], *LEARNERS):
        blackboard.hear(each, 2)
    blackboard.hear("robot1#1", 1, NOW - 0.1)

    assert blackboard.do(Tick(0.0), NOW + 1.0) == []


def test_only_a_member_that_is_far_behind_is_sent_the_snapshot(blackboard):
    for number in range(200):
        blackboard.propose(f"T{number}")
        for each in (*VOTERS[1:], LEARNERS[0]):
            blackboard.hear(each, blackboard.member.log.position.version)

    ((versions, to),) = blackboard.do(Tick(0.0), NOW + 0.1)

    assert versions[0] > 2
    assert to == {"robot9"}


def test_one_of_two_that_goes_on_alone_commits_what_was_in_flight_to_the_other(blackboard):
    both = (VOTERS[0], VOTERS[1])
    log = Log.of(Snapshot(Position(1, 1), members=both))
    peers = MappingProxyType({VOTERS[1]: Peer(1, NOW, NOW + 5.0, NOW)})
    blackboard.member = blackboard.member.evolve(log=log, peers=peers)
    blackboard.propose("T1")

    blackboard.do(Tick(0.0), NOW + 1.0)
    blackboard.propose("T2")

    assert blackboard.member.members == (VOTERS[0],)
    assert blackboard.member.log.committed == blackboard.member.log.position.version


@pytest.mark.parametrize(
    ("message", "receiver"),
    [
        (Heartbeat(2, "blackboard"), "blackboard"),
        (AppendEntries(2, "blackboard#1", Position(1, 1), (), 1, NOW), "blackboard"),
        (Heartbeat(1, "robot2"), "robot2"),
    ],
)
def test_a_reply_goes_to_the_leader_that_is_answered_and_to_nobody_else(message, receiver):
    log = Log.of(Snapshot(Position(1, 1), members=VOTERS))
    follower = Member("robot1#1", RaftSettings(), log, epoch=2)

    _, (reply,) = step(follower, message, NOW)

    assert reply.to == (receiver,)
