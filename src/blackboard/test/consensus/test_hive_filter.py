# SPDX-License-Identifier: BSD-3-Clause
"""Whom a member listens to: its own hive, and no epoch that is over."""

from random import Random

import pytest

from blackboard.consensus.bootstrap import founder
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.member import Role
from blackboard.consensus.messages import AppendReply, Heartbeat
from blackboard.consensus.node import RaftNode
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.settings import RaftSettings
from blackboard.domain.talker import BACKUP, BB_ACK, NEW_TASK, SYNC, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.network import Network, NetworkTalker

OTHERS = ("robot1", "robot2", "robot3")
TASK = Task("T1", TaskType.GA, (Pose(1.0, 1.0),))


class Member:
    """One member alone on a network, where the test speaks for everyone else."""

    def __init__(self, name="robot9", disk=None, *, founds=False):
        self.network = Network()
        self.talker = NetworkTalker(self.network, name)
        self.disk = disk or MemoryJournal()
        self.backup = RaftNode(
            self.talker, name, RaftSettings(), self.disk, Random(1), founds=founds
        )
        self.backup.start()
        self.network.run(0.1)

    def hear_beats(self, hive, epoch, seconds, leader="robot1", members=OTHERS):
        """Have the active one of a hive heard for some time."""
        for _ in range(round(seconds / 0.2)):
            beat = Heartbeat(epoch, leader, members=members, hive=hive)
            self.network.send(BACKUP, beat)
            self.network.run(0.2)

    def posted(self):
        """Return the tasks that it has posted."""
        return [message for topic, message in self.network.heard if topic == NEW_TASK]


def test_a_newcomer_obeys_nobody():
    assert not Member().backup.obeys("hive1", 1)


def test_a_newcomer_joins_the_hive_of_the_first_active_one_that_it_hears():
    member = Member()

    member.hear_beats("hive1", 4, seconds=1.0)
    member.hear_beats("hive2", 9, seconds=1.0, members=("robot4",))

    assert (member.backup.hive, member.backup.epoch) == ("hive1", 4)


def test_a_member_without_a_vote_goes_over_to_a_greater_hive():
    member = Member()

    member.hear_beats("hive1", 4, seconds=1.0, members=("robot4",))
    member.hear_beats("hive2", 1, seconds=1.0)

    assert (member.backup.hive, member.backup.epoch) == ("hive2", 1)


@pytest.mark.parametrize(
    ("hive", "epoch", "is_obeyed"),
    [("hive1", 4, True), ("hive1", 5, True), ("hive1", 3, False), ("hive2", 9, False)],
)
def test_the_own_hive_is_obeyed_from_the_highest_known_epoch_on(hive, epoch, is_obeyed):
    member = Member()
    member.hear_beats("hive1", 4, seconds=1.0)

    assert member.backup.obeys(hive, epoch) is is_obeyed


def test_the_highest_epoch_is_known_after_a_restart():
    before = Member()
    before.hear_beats("hive1", 4, seconds=1.0)

    after = Member(disk=before.disk)

    assert not after.backup.obeys("hive1", 3)
    assert after.backup.obeys("hive1", 4)


def test_a_refused_epoch_is_reported_once():
    member = Member()
    member.hear_beats("hive1", 4, seconds=1.0)

    for _ in range(3):
        member.backup.obeys("hive1", 3)

    assert len(member.talker.warnings) == 1
    assert "refuses what the blackboard of epoch 3 says" in member.talker.warnings[0]


def test_a_founder_founds_where_nobody_is_heard():
    member = Member("blackboard", founds=True)

    member.network.run(3.0)

    assert member.backup.member.role is Role.LEADER
    assert member.backup.hive


def test_a_founder_founds_nothing_beside_a_hive_whose_members_it_has_heard():
    member = Member("blackboard", founds=True)
    member.network.send(BB_ACK, AppendReply("robot1#1", 3, 0, 0.0, "hive1"))

    member.network.run(60.0)

    assert member.backup.hive == ""
    assert "waits for that hive and founds no other" in member.talker.warnings[0]


def test_a_founder_joins_the_hive_that_it_has_waited_for():
    member = Member("blackboard", founds=True)
    member.network.send(BB_ACK, AppendReply("robot1#1", 3, 0, 0.0, "hive1"))
    member.network.run(5.0)

    member.hear_beats("hive1", 4, seconds=3.0)

    assert member.backup.hive == "hive1"


def lone_founder():
    """Return a member that has founded a hive alone and has a task on its list."""
    member = Member("blackboard", MemoryJournal(founder("blackboard#1", "hive1")))
    member.backup.commit((TaskRecord(TASK),), lambda: None)
    return member


def test_a_lone_founder_hands_its_tasks_over_before_it_joins_the_greater_hive():
    member = lone_founder()
    member.hear_beats("hive2", 1, seconds=1.0)
    still_alone = member.backup.hive

    taken_in = TaskList(1, 5, (TaskRecord(TASK),), "hive2")
    member.network.send(SYNC, taken_in)
    member.hear_beats("hive2", 1, seconds=1.0)

    assert set(member.posted()) == {TASK}
    assert still_alone == "hive1"
    assert member.backup.hive == "hive2"
    assert member.backup.member.id != "blackboard#1"


def test_what_its_own_blackboard_said_is_no_answer_to_a_lone_founder():
    member = lone_founder()
    member.hear_beats("hive2", 1, seconds=0.4)

    member.network.send(TASK_STATE, TaskUpdate("T1", TaskState.WAITING, epoch=1))
    member.network.send(SYNC, TaskList(1, 3, (TaskRecord(TASK),), "hive1"))
    member.hear_beats("hive2", 1, seconds=1.0)

    assert member.backup.hive == "hive1"


def test_a_task_that_the_greater_hive_refuses_is_reported_to_a_person():
    member = lone_founder()
    member.hear_beats("hive2", 1, seconds=0.4)

    refusal = TaskUpdate("T1", TaskState.REJECTED, reason="the id is taken")
    member.network.send(TASK_STATE, refusal)
    member.hear_beats("hive2", 1, seconds=1.0)

    assert member.backup.hive == "hive2"
    assert "cannot hand it over: the id is taken" in member.talker.warnings[-1]


def test_a_smaller_hive_decides_nothing_while_the_greater_one_is_heard():
    member = lone_founder()

    member.hear_beats("hive2", 1, seconds=1.0)
    gives_way = member.backup.may_act()
    member.network.run(10.0)

    assert not gives_way
    assert member.backup.may_act()


def test_a_greater_hive_does_not_give_way():
    member = lone_founder()

    member.hear_beats("hive0", 9, seconds=1.0, members=("robot1",))

    assert member.backup.may_act()
    assert "the other one gives way" in member.talker.warnings[0]
