# SPDX-License-Identifier: BSD-3-Clause
"""The task list and the heartbeat of the blackboard that carries it."""

from dataclasses import replace

from blackboard.backup import TaskList
from blackboard.pose import Pose
from blackboard.record import TaskRecord
from blackboard.talker import BACKUP, SYNC
from blackboard.task import Task, TaskState, TaskType
from blackboard.testing import Network, NetworkTalker, lone_backup

ONE = TaskRecord(Task("T1", TaskType.GA, (Pose(1.0, 1.0),)))
TWO = TaskRecord(Task("T2", TaskType.GA, (Pose(2.0, 1.0),)))


def started():
    """Return a network and a backup that has begun to speak on it."""
    network = Network()
    backup = lone_backup(NetworkTalker(network, "blackboard"))
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
    assert (first.epoch, first.active, first.backup) == (1, "blackboard", "")
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
    assert backup.records == (ONE,)
