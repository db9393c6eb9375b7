# SPDX-License-Identifier: BSD-3-Clause
"""Whom a member obeys: its own hive, and no epoch that is over."""

from dataclasses import replace
from random import Random

import pytest

from blackboard.consensus.bootstrap import new_hive
from blackboard.consensus.journal import HardState, MemoryJournal
from blackboard.consensus.log import Log, Position, Snapshot
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

    def __init__(self, name="robot9", disk=None, *, bootstrap=False):
        self.network = Network()
        self.talker = NetworkTalker(self.network, name)
        self.disk = disk or MemoryJournal()
        self.node = RaftNode(
            self.talker, name, RaftSettings(), self.disk, Random(1), bootstrap=bootstrap
        )
        self.node.start()
        self.network.run(0.1)

    def hear_beats(self, hive, epoch, seconds, leader="robot1", members=OTHERS, version=0):
        """Send the heartbeats of the leader of a hive for some time [s]."""
        for _ in range(round(seconds / 0.2)):
            beat = Heartbeat(epoch, leader, members=members, version=version, hive=hive)
            self.network.send(BACKUP, beat)
            self.network.run(0.2)

    def tell_of(self, members, echo, version=0, hive="hive2"):
        """Send what a member of a hive says of it, in answer to a heartbeat of a time [s]."""
        answer = AppendReply("robot1#1", 3, version, echo, hive, members=members)
        self.network.send(BB_ACK, answer)
        self.network.run(0.1)

    def posted(self):
        """Return the tasks that the member has posted."""
        return [message for topic, message in self.network.heard if topic == NEW_TASK]


def test_a_new_member_obeys_nobody():
    assert not Member().node.obeys("hive1", 1)


def test_a_new_member_joins_the_hive_of_the_first_leader_it_hears():
    member = Member()

    member.hear_beats("hive1", 4, seconds=1.0)
    member.hear_beats("hive2", 9, seconds=1.0, members=("robot4",))

    assert (member.node.hive, member.node.epoch) == ("hive1", 4)


def test_a_member_without_a_vote_joins_a_larger_hive():
    member = Member()

    member.hear_beats("hive1", 4, seconds=1.0, members=("robot4",))
    member.hear_beats("hive2", 1, seconds=1.0)

    assert (member.node.hive, member.node.epoch) == ("hive2", 1)


def test_a_member_stays_in_a_hive_that_has_become_the_larger_one():
    member = Member()
    member.hear_beats("hive1", 4, seconds=1.0, members=("robot4",))

    member.network.send(BACKUP, Heartbeat(1, "robot1", members=("robot1",), hive="hive2"))
    member.hear_beats("hive1", 4, seconds=1.0, members=("robot4", "robot5"))

    assert member.node.hive == "hive1"


def test_a_hive_decides_again_at_once_when_the_larger_one_has_lost_members():
    member = Member("blackboard", bootstrap=True)
    member.network.run(3.0)
    own = member.node.hive
    for members in (OTHERS, ()):
        beat = Heartbeat(1, "robot1", members=members, hive="0")
        member.network.send(BACKUP, beat)
        member.network.run(0.01)

    member.network.run(0.3)

    assert member.node.hive == own


@pytest.mark.parametrize(
    ("hive", "epoch", "is_obeyed"),
    [("hive1", 4, True), ("hive1", 5, True), ("hive1", 3, False), ("hive2", 9, False)],
)
def test_the_own_hive_is_obeyed_from_the_highest_known_epoch_on(hive, epoch, is_obeyed):
    member = Member()
    member.hear_beats("hive1", 4, seconds=1.0)

    assert member.node.obeys(hive, epoch) is is_obeyed


def test_the_highest_epoch_is_known_after_a_restart():
    before = Member()
    before.hear_beats("hive1", 4, seconds=1.0)

    after = Member(disk=before.disk)

    assert not after.node.obeys("hive1", 3)
    assert after.node.obeys("hive1", 4)


def test_a_refused_epoch_is_reported_once():
    member = Member()
    member.hear_beats("hive1", 4, seconds=1.0)

    for _ in range(3):
        member.node.obeys("hive1", 3)

    assert len(member.talker.warnings) == 1
    assert "ignores the blackboard of epoch 3" in member.talker.warnings[0]


def test_a_member_bootstraps_a_hive_if_it_hears_nobody():
    member = Member("blackboard", bootstrap=True)

    member.network.run(3.0)

    assert member.node.member.role is Role.LEADER
    assert member.node.hive


def test_a_member_bootstraps_no_hive_beside_one_whose_members_it_hears():
    member = Member("blackboard", bootstrap=True)
    member.network.send(BB_ACK, AppendReply("robot1#1", 3, 0, 0.0, "hive1"))

    member.network.run(60.0)

    assert member.node.hive == ""
    assert "waits for that hive and does not bootstrap another" in member.talker.warnings[0]


def test_a_member_joins_the_hive_it_has_waited_for():
    member = Member("blackboard", bootstrap=True)
    member.network.send(BB_ACK, AppendReply("robot1#1", 3, 0, 0.0, "hive1"))
    member.network.run(5.0)

    member.hear_beats("hive1", 4, seconds=3.0)

    assert member.node.hive == "hive1"


def only_member(record=TaskRecord(TASK)):  # noqa: B008 (it is immutable)
    """Return the only member of a hive, with a task on its list."""
    member = Member("blackboard", MemoryJournal(new_hive("blackboard#1", "hive1")))
    member.node.commit((record,), lambda: None)
    return member


def test_an_only_member_hands_its_tasks_over_before_it_joins_the_larger_hive():
    member = only_member()
    member.hear_beats("hive2", 1, seconds=1.0)
    still_alone = member.node.hive

    taken_in = TaskList(1, 5, (TaskRecord(TASK),), "hive2")
    member.network.send(SYNC, taken_in)
    member.hear_beats("hive2", 1, seconds=1.0)

    assert set(member.posted()) == {TASK}
    assert still_alone == "hive1"
    assert member.node.hive == "hive2"
    assert member.node.member.id != "blackboard#1"


@pytest.mark.parametrize("state", [TaskState.ASSIGNED, TaskState.STARTED])
def test_an_only_member_whose_robots_have_tasks_waits_for_a_person(state):
    held = TaskRecord(TASK, state, robot="robot5", assignment=1)
    member = only_member(held)

    member.hear_beats("hive2", 1, seconds=1.0)
    member.network.send(SYNC, TaskList(1, 5, (replace(held, robot="robot1"),), "hive2"))
    member.hear_beats("hive2", 1, seconds=30.0)

    assert member.node.hive == "hive1"
    assert not member.node.may_act()
    assert not member.posted()
    assert (
        "have a member join the other hive, stop it, move its journal"
        in (member.talker.warnings[0])
    )


def test_an_only_member_whose_tasks_have_ended_joins_the_larger_hive():
    member = only_member(TaskRecord(TASK, TaskState.DONE, robot="robot5", assignment=1))

    member.hear_beats("hive2", 1, seconds=1.0)

    assert member.node.hive == "hive2"


def test_messages_of_its_own_blackboard_do_not_count_as_an_answer():
    member = only_member()
    member.hear_beats("hive2", 1, seconds=0.4)

    member.network.send(TASK_STATE, TaskUpdate("T1", TaskState.WAITING, epoch=1))
    member.network.send(SYNC, TaskList(1, 3, (TaskRecord(TASK),), "hive1"))
    member.hear_beats("hive2", 1, seconds=1.0)

    assert member.node.hive == "hive1"


def test_a_task_that_the_larger_hive_refuses_is_reported():
    member = only_member()
    member.hear_beats("hive2", 1, seconds=0.4)

    refusal = TaskUpdate("T1", TaskState.REJECTED, reason="the id is taken")
    member.network.send(TASK_STATE, refusal)
    member.hear_beats("hive2", 1, seconds=1.0)

    assert member.node.hive == "hive2"
    assert (
        "cannot hand over T1, which it had accepted: the id is taken" in member.talker.warnings[-1]
    )


def test_a_smaller_hive_decides_nothing_while_it_hears_the_larger_one():
    member = only_member()

    member.hear_beats("hive2", 1, seconds=1.0)
    may_act = member.node.may_act()
    member.network.run(10.0)

    assert not may_act
    assert member.node.may_act()


def test_a_smaller_hive_decides_nothing_while_members_of_a_larger_one_answer_without_a_leader():
    member = only_member()

    member.tell_of(3, echo=member.network.now)

    assert not member.node.may_act()
    assert "hears hive hive2 (3 members, according to robot1)" in member.talker.warnings[0]


@pytest.mark.parametrize("late", [-60.0, 1.0])
def test_what_answers_no_heartbeat_of_this_leader_stops_no_hive(late):
    member = only_member()

    member.tell_of(65_535, echo=member.network.now + late)

    assert member.node.may_act()


def test_a_smaller_hive_goes_on_when_the_larger_one_has_had_no_leader_for_long():
    member = only_member()
    acted = []
    for _ in range(60):
        member.tell_of(3, echo=member.network.now)
        acted.append(member.node.may_act())
        member.network.run(0.4)

    assert not any(acted[:20])
    assert all(acted[30:])


def test_a_smaller_hive_waits_again_for_a_larger_one_that_was_silent_meanwhile():
    member = only_member()
    for _ in range(60):
        member.tell_of(3, echo=member.network.now)
        member.network.run(0.4)
    goes_on = member.node.may_act()
    member.network.run(60.0)

    member.tell_of(3, echo=member.network.now)

    assert goes_on
    assert not member.node.may_act()


@pytest.mark.parametrize(("version", "goes_on"), [(1, True), (2, False)])
def test_a_member_that_lacks_what_its_leader_has_told_may_not_know_the_size_of_its_hive(
    version, goes_on
):
    member = only_member()
    member.hear_beats("hive0", 3, seconds=0.2, members=("robot1",), version=2)

    member.tell_of(2, echo=member.network.now, version=version, hive="hive0")

    assert member.node.may_act() == goes_on


@pytest.mark.parametrize(("members", "answers"), [(("robot4",), True), (OTHERS, False)])
def test_a_member_answers_the_leader_of_a_smaller_hive(members, answers):
    member = Member()
    member.hear_beats("hive1", 4, seconds=1.0, members=("robot1", "robot2"))
    said = len(member.network.heard)

    member.hear_beats("hive2", 1, seconds=0.2, leader="robot4", members=members)
    told = [
        (message.hive, message.members, message.to)
        for topic, message in member.network.heard[said:]
        if topic == BB_ACK
    ]

    assert told == [("hive1", 2, ("robot4",))] * answers


@pytest.mark.parametrize(
    ("other", "version", "goes_on"),
    [
        ("hive2", 2, True),  # its own list has version 3
        ("hive2", 3, False),
        ("hive0", 3, True),
        ("hive0", 4, False),
    ],
)
def test_of_two_hives_as_large_the_one_that_has_committed_less_gives_way(other, version, goes_on):
    member = only_member()

    member.hear_beats(other, 1, seconds=1.0, members=("robot1",), version=version)

    assert member.node.may_act() == goes_on


def test_a_member_without_a_vote_knows_from_its_leader_how_much_its_hive_has_committed():
    member = Member()
    member.hear_beats("hive1", 3, seconds=1.0, leader="robot1", members=("robot1",), version=7)

    member.hear_beats("hive2", 1, seconds=1.0, leader="robot2", members=("robot2",), version=6)
    stays = member.node.hive
    member.hear_beats("hive2", 1, seconds=1.0, leader="robot2", members=("robot2",), version=8)

    assert (stays, member.node.hive) == ("hive1", "hive2")


def test_a_larger_hive_goes_on():
    member = only_member()

    member.hear_beats("hive0", 9, seconds=1.0, members=("robot1",))

    assert member.node.may_act()
    assert "the other hive pauses" in member.talker.warnings[0]


def test_each_change_of_which_hive_pauses_is_told_once():
    member = only_member()

    for members in [("robot1",), ("robot1", "robot2")] * 3:
        member.hear_beats("hive0", 9, seconds=1.0, members=members)
    told = [text for text in member.talker.warnings if "hears hive hive0 (" in text]

    assert ["the other hive pauses" in text for text in told] == [True, False]


def voter_of_three():
    """The disk of one of three members of a hive, with a task on its list."""
    members = ("robot9#1", "robot1#1", "robot2#1")
    log = Log.of(Snapshot(Position(3, 4), {"T1": TaskRecord(TASK)}, members))
    return MemoryJournal(HardState("robot9#1", 3, "", log, "hive1"))


def test_a_member_joins_the_hive_as_which_its_own_was_recovered_once_it_has_no_leader():
    member = Member(disk=voter_of_three())

    member.hear_beats("hive1.1", 4, seconds=9.0, members=("robot1",))
    stays = member.node.hive
    member.hear_beats("hive1.1", 4, seconds=2.0, members=("robot1",))

    assert (stays, member.node.hive) == ("hive1", "hive1.1")
    assert member.node.member.log.latest.members == ()
    assert member.posted() == []
    assert "had the open tasks T1; post again what" in member.talker.warnings[-1]


def test_a_member_stays_where_another_hive_was_made_of_its_own_while_that_had_a_leader():
    member = Member(disk=voter_of_three())

    for _ in range(5):
        member.hear_beats("hive1", 3, seconds=0.2)
        member.hear_beats("hive1.1", 4, seconds=0.2, members=("robot1",))
    member.hear_beats("hive1.1", 4, seconds=60.0, members=("robot1",))

    assert member.node.hive == "hive1"


def test_a_member_stays_where_another_hive_is_not_its_own_recovered():
    member = Member(disk=voter_of_three())

    member.hear_beats("hive10.1", 4, seconds=60.0, members=("robot1",))

    assert member.node.hive == "hive1"
