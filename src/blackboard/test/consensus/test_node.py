# SPDX-License-Identifier: BSD-3-Clause
"""The task list and the heartbeats of a member."""

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
from blackboard.errors import JournalError
from hive_common.map_id import NO_MAP, MapId
from hive_common.pose import Pose
from hive_lab.virtual.hive import lone_node
from hive_lab.virtual.network import Network, NetworkTalker

ONE = TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 1.0),)))
TWO = TaskRecord(Task("T2", TaskType.GA, (Pose(2.0, 1.0),)))


def started():
    """Return a network and the only member of a hive on it."""
    network = Network()
    node = lone_node(NetworkTalker(network, "blackboard"))
    node.start()
    return network, node


def sent(network, topic):
    """Return the messages of a topic."""
    return [message for name, message in network.heard if name == topic]


def test_heartbeats_come_at_their_rate_and_show_progress():
    network, _ = started()

    network.run(1.01)

    beats = sent(network, BACKUP)
    assert [beat.progress for beat in beats] == [1, 2, 3, 4, 5, 6]
    first = beats[0]
    assert (first.epoch, first.leader, first.backup) == (1, "blackboard", "")
    assert first.members == ("blackboard",)


def test_heartbeats_tell_which_map_the_leader_uses_and_it_knows_that_itself():
    network, node = started()
    node.tell_map(MapId("hall", "01"))
    network.run(1.0)

    assert sent(network, BACKUP)[-1].map == MapId("hall", "01")
    assert node.leaders_map == MapId("hall", "01")


def test_an_empty_list_is_published_at_the_start():
    network, _ = started()

    assert sent(network, SYNC) == [TaskList(1, 2, (), "hive1")]


def test_changes_within_the_sync_period_are_published_together():
    network, node = started()
    node.commit((ONE,), lambda: None)
    node.commit((TWO,), lambda: None)

    network.run(5.0)

    assert sent(network, SYNC)[1:] == [TaskList(1, 4, (ONE, TWO), "hive1")]


def test_a_later_change_is_published_with_a_higher_version_in_the_order_of_posting():
    network, node = started()
    node.commit((ONE,), lambda: None)
    node.commit((TWO,), lambda: None)
    network.run(1.0)
    done = replace(ONE, state=TaskState.DONE)

    node.commit((done,), lambda: None)
    network.run(1.0)

    assert sent(network, SYNC)[-1] == TaskList(1, 5, (done, TWO), "hive1")


def test_the_list_is_published_again_on_request_without_a_new_version():
    network, node = started()
    node.commit((ONE,), lambda: None)
    network.run(1.0)

    node.tell()
    node.tell()
    network.run(1.0)

    assert sent(network, SYNC)[2:] == [TaskList(1, 3, (ONE,), "hive1")]


def test_a_task_is_found_by_its_name():
    _, node = started()
    node.commit((ONE,), lambda: None)

    assert node.get("T1") == ONE
    assert node.get("T9") is None
    assert tuple(node.records.values()) == (ONE,)


def test_a_change_is_sent_while_the_leader_writes_it_and_nothing_follows_if_it_cannot():
    network, node = started()
    committed = []

    class Full(MemoryJournal):
        def save(self, _):
            raise JournalError("the disk is full")

    node._journal = Full()  # noqa: SLF001  (the disk fills up while the member leads)
    node.commit((ONE,), lambda: committed.append(ONE))
    network.run(0.01)

    assert [entry.records for entry in sent(network, BB_ENTRIES)[-1].entries] == [(ONE,)]
    assert (committed, node.may_act(), node.get("T1")) == ([], False, None)


def test_a_record_that_is_held_is_on_the_list_and_lost_when_the_leader_steps_down():
    network, node = started()
    told = []
    node.hold(ONE, lambda: told.append(ONE))
    listed = node.get("T1")

    node._step_down()  # noqa: SLF001  (as it does when it hears a larger hive)
    network.run(1.0)

    assert (listed, node.get("T1"), told) == (ONE, None, [])


def test_what_is_forgotten_while_a_record_is_held_leaves_the_list():
    _, node = started()
    node.commit((replace(ONE, state=TaskState.DONE),), lambda: None)
    node.hold(TWO, lambda: None)

    node.forget(("T1",))

    assert tuple(node.records.values()) == (TWO,)


class Follower:
    """robot9, a member that follows `blackboard`, and the lists that its robot receives."""

    def __init__(self):
        self.network = Network()
        talker = NetworkTalker(self.network, "robot9")
        self.node = RaftNode(talker, "robot9", RaftSettings(), MemoryJournal(), Random(1))
        self.told = []
        self.node.follow(self.told.append)
        self.node.start()

    def hear(self, *entries, committed, before=Position(1, 1)):  # noqa: B008  (a value)
        """Send entries after a position as the leader, committed up to a version."""
        snapshot = Snapshot(before, {}, ("blackboard#1", "robot9#1")) if before == (1, 1) else None
        message = AppendEntries(
            1, "blackboard#1", before, entries, committed, 0.0, snapshot, "hive1"
        )
        self.network.send(BB_ENTRIES, message)
        self.network.run(0.01)

    def beat(self, version):
        """Send a heartbeat as the leader, which says what is committed."""
        beat = Heartbeat(1, "blackboard", version=version, hive="hive1")
        self.network.send(BACKUP, beat)
        self.network.run(0.01)


def test_the_robot_beside_a_member_receives_only_what_is_committed():
    member = Follower()
    member.hear(Entry(1, 2, (ONE,)), Entry(1, 3, (TWO,)), committed=2)
    member.network.run(1.0)
    before = list(member.told)

    member.beat(version=3)
    member.network.run(1.0)

    assert before == [TaskList(1, 2, (ONE,), "hive1")]
    assert member.told[1:] == [TaskList(1, 3, (ONE, TWO), "hive1")]


def test_the_robot_is_told_up_to_which_assignment_tasks_are_forgotten():
    member = Follower()
    ended = replace(ONE, state=TaskState.DONE, assignment=3)
    member.hear(Entry(1, 2, (ended,)), Entry(1, 3, (), forgotten=("T1",)), committed=3)

    member.network.run(1.0)

    assert member.told == [TaskList(1, 3, (), "hive1", earlier=3)]


def test_the_robot_receives_changes_within_the_sync_period_together():
    member = Follower()
    member.hear(Entry(1, 2, (ONE,)), committed=2)
    member.hear(Entry(1, 3, (TWO,)), committed=3, before=Position(1, 2))

    member.network.run(5.0)

    assert member.told == [TaskList(1, 3, (ONE, TWO), "hive1")]


def test_the_robot_receives_the_list_again_on_request():
    member = Follower()
    member.hear(Entry(1, 2, (ONE,)), committed=2)
    member.network.run(1.0)

    member.node.show()
    member.node.show()
    member.network.run(1.0)

    assert member.told == [TaskList(1, 2, (ONE,), "hive1")] * 2


def test_the_robot_beside_the_leader_receives_the_list_as_well():
    network, node = started()
    told = []
    node.follow(told.append)
    node.commit((ONE,), lambda: None)

    network.run(1.0)

    assert told[-1].records == (ONE,)


def test_a_member_that_follows_knows_the_leaders_map_which_may_not_be_its_own():
    member = Follower()
    member.node.tell_map(MapId("shelf", "02"))
    before = member.node.leaders_map
    beat = Heartbeat(1, "blackboard", hive="hive1", map=MapId("hall", "01"))
    member.network.send(BACKUP, beat)
    member.network.run(0.01)

    assert before == NO_MAP
    assert member.node.leaders_map == MapId("hall", "01")
