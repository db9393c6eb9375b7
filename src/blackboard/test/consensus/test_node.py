# SPDX-License-Identifier: BSD-3-Clause
"""The task list and the heartbeat of the blackboard that carries it."""

from dataclasses import replace
from random import Random

from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.log import Entry, Position, Snapshot
from blackboard.consensus.messages import AppendEntries, Heartbeat
from blackboard.consensus.node import RaftNode
from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import TaskRecord
from blackboard.domain.settings import RaftSettings
from blackboard.domain.talker import BACKUP, BB_ENTRIES, SYNC
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import lone_node
from hive_lab.virtual.network import Network, NetworkTalker

ONE = TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 1.0),)))
TWO = TaskRecord(Task("T2", TaskType.GA, (Pose(2.0, 1.0),)))


def started():
    """Return a network and a backup that has begun to speak on it."""
    network = Network()
    backup = lone_node(NetworkTalker(network, "blackboard"))
    backup.start()
    return network, backup


def said(network, topic):
    """Return what was said on a topic."""
    return [message for name, message in network.heard if name == topic]


def test_the_heartbeat_comes_at_its_rate_and_shows_progress():
    network, _ = started()

    network.run(1.01)

    beats = said(network, BACKUP)
    assert [beat.progress for beat in beats] == [1, 2, 3, 4, 5, 6]
    first = beats[0]
    assert (first.epoch, first.leader, first.backup) == (1, "blackboard", "")
    assert first.members == ("blackboard",)


def test_an_empty_list_is_told_at_the_start():
    network, _ = started()

    assert said(network, SYNC) == [TaskList(1, 2, (), "hive1")]


def test_changes_within_the_sync_period_are_told_together():
    network, backup = started()
    backup.commit((ONE,), lambda: None)
    backup.commit((TWO,), lambda: None)

    network.run(5.0)

    assert said(network, SYNC)[1:] == [TaskList(1, 4, (ONE, TWO), "hive1")]


def test_a_later_change_is_told_with_a_higher_version_in_the_order_of_posting():
    network, backup = started()
    backup.commit((ONE,), lambda: None)
    backup.commit((TWO,), lambda: None)
    network.run(1.0)
    done = replace(ONE, state=TaskState.DONE)

    backup.commit((done,), lambda: None)
    network.run(1.0)

    assert said(network, SYNC)[-1] == TaskList(1, 5, (done, TWO), "hive1")


def test_the_list_is_told_again_on_request_without_a_new_version():
    network, backup = started()
    backup.commit((ONE,), lambda: None)
    network.run(1.0)

    backup.tell()
    backup.tell()
    network.run(1.0)

    assert said(network, SYNC)[2:] == [TaskList(1, 3, (ONE,), "hive1")]


def test_a_task_is_found_by_its_name():
    _, backup = started()
    backup.commit((ONE,), lambda: None)

    assert backup.get("T1") == ONE
    assert backup.get("T9") is None
    assert tuple(backup.records.values()) == (ONE,)


class Follower:
    """robot9, a member that follows `blackboard`, and what the robot beside it is told."""

    def __init__(self):
        self.network = Network()
        talker = NetworkTalker(self.network, "robot9")
        self.backup = RaftNode(talker, "robot9", RaftSettings(), MemoryJournal(), Random(1))
        self.told = []
        self.backup.follow(self.told.append)
        self.backup.start()

    def hear(self, *entries, committed, before=Position(1, 1)):  # noqa: B008  (a value)
        """Have the active one write changes behind a position, which it says are committed."""
        snapshot = Snapshot(before, {}, ("blackboard#1", "robot9#1")) if before == (1, 1) else None
        message = AppendEntries(
            1, "blackboard#1", before, entries, committed, 0.0, snapshot, "hive1"
        )
        self.network.send(BB_ENTRIES, message)
        self.network.run(0.01)

    def beat(self, version):
        """Have the active one say up to where the list is committed."""
        beat = Heartbeat(1, "blackboard", version=version, hive="hive1")
        self.network.send(BACKUP, beat)
        self.network.run(0.01)


def test_the_robot_beside_a_member_is_told_only_what_is_committed():
    member = Follower()
    member.hear(Entry(1, 2, (ONE,)), Entry(1, 3, (TWO,)), committed=2)
    member.network.run(1.0)
    before = list(member.told)

    member.beat(version=3)
    member.network.run(1.0)

    assert before == [TaskList(1, 2, (ONE,), "hive1")]
    assert member.told[1:] == [TaskList(1, 3, (ONE, TWO), "hive1")]


def test_the_robot_is_told_changes_within_the_sync_period_together():
    member = Follower()
    member.hear(Entry(1, 2, (ONE,)), committed=2)
    member.hear(Entry(1, 3, (TWO,)), committed=3, before=Position(1, 2))

    member.network.run(5.0)

    assert member.told == [TaskList(1, 3, (ONE, TWO), "hive1")]


def test_the_robot_is_told_again_on_request():
    member = Follower()
    member.hear(Entry(1, 2, (ONE,)), committed=2)
    member.network.run(1.0)

    member.backup.show()
    member.backup.show()
    member.network.run(1.0)

    assert member.told == [TaskList(1, 2, (ONE,), "hive1")] * 2


def test_the_robot_beside_the_active_one_is_told_as_well():
    network, backup = started()
    told = []
    backup.follow(told.append)
    backup.commit((ONE,), lambda: None)

    network.run(1.0)

    assert told[-1].records == (ONE,)
