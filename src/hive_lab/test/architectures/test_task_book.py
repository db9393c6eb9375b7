# SPDX-License-Identifier: BSD-3-Clause
"""A node that nobody replaces gives tasks to robots and follows them."""

from dataclasses import replace

import pytest

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import OrderKind, TaskUpdate
from blackboard.domain.talker import TASK_ASSIGN, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.architectures.task_book import TaskBook
from hive_lab.virtual.network import Network, NetworkTalker

HERE = Pose(0.0, 0.0)
GO = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))


class Node:
    """A book on a network, and what it has said."""

    def __init__(self):
        self.network = Network()
        self.talker = NetworkTalker(self.network, "manager")
        self.book = TaskBook(self.talker, "manager", EuclideanLengths())

    def orders(self):
        said = [each for topic, each in self.network.sent if topic == TASK_ASSIGN]
        return [(order.robot_id, order.kind) for order in said]

    def told(self):
        return [each.state for topic, each in self.network.sent if topic == TASK_STATE]

    def status(self, robot, *tasks):
        self.book.hear_status(RobotStatus(robot, RobotState.BUSY, HERE, 1.0, tasks=tasks))

    def report(self, robot, state, assignment=1, **fields):
        return self.book.hear_update(
            TaskUpdate("T1", state, robot, assignment=assignment, **fields)
        )


@pytest.fixture
def node():
    """Return a node that has given T1 to robot1."""
    node = Node()
    node.book.take_in(GO)
    node.book.give("T1", "robot1")
    return node


def test_a_task_is_taken_on_once_and_the_operator_is_told_each_time():
    node = Node()

    assert node.book.take_in(GO)
    assert not node.book.take_in(replace(GO, posted=5.0))

    assert node.told() == [TaskState.WAITING] * 2
    assert [record.task.id for record in node.book.waiting()] == ["T1"]


def test_a_task_that_nobody_can_do_is_rejected():
    node = Node()

    assert not node.book.take_in(replace(GO, goals=()))

    assert node.told() == [TaskState.REJECTED]
    assert not node.book.records


def test_an_order_is_repeated_until_the_robot_shows_it(node):
    node.network.run(1.9)
    node.status("robot1")
    assert node.orders() == [("robot1", OrderKind.ASSIGN)]

    node.network.run(0.2)
    node.status("robot1")
    assert node.orders() == [("robot1", OrderKind.ASSIGN)] * 2

    node.network.run(2.1)
    node.status("robot1", "T1")
    assert node.orders() == [("robot1", OrderKind.ASSIGN)] * 2


def test_an_order_to_a_robot_that_says_nothing_is_repeated(node):
    node.network.run(1.9)
    node.book.repeat()
    assert len(node.orders()) == 1

    node.network.run(0.2)
    node.book.repeat()
    assert len(node.orders()) == 2


def test_the_tasks_of_a_robot_that_is_silent_for_five_seconds_wait_again(node):
    node.network.run(4.9)
    assert not node.book.release_lost()

    node.network.run(0.2)
    assert node.book.release_lost()
    assert [record.task.id for record in node.book.waiting()] == ["T1"]


def test_any_message_of_a_robot_shows_that_it_lives(node):
    node.network.run(4.0)
    node.report("robot1", TaskState.STARTED)
    node.network.run(4.0)

    assert not node.book.release_lost()


def test_what_is_done_is_acknowledged_each_time_it_is_reported(node):
    assert node.report("robot1", TaskState.DONE).state is TaskState.DONE
    assert node.report("robot1", TaskState.DONE) is None

    assert node.orders()[1:] == [("robot1", OrderKind.FORGOTTEN)] * 2


def test_a_robot_that_has_done_a_task_after_all_is_believed_and_the_other_one_stops(node):
    node.network.run(6.0)
    node.book.release_lost()
    node.book.give("T1", "robot2")

    assert node.report("robot1", TaskState.DONE).state is TaskState.DONE

    assert node.orders()[-2:] == [
        ("robot1", OrderKind.FORGOTTEN),
        ("robot2", OrderKind.TAKE_BACK),
    ]


def test_a_start_that_is_reported_late_changes_nothing(node):
    node.report("robot1", TaskState.STARTED, step=1)

    assert node.report("robot1", TaskState.STARTED, step=1) is None
    assert node.report("robot2", TaskState.STARTED, step=2) is None


def test_a_task_that_is_handed_back_waits_again(node):
    assert node.report("robot1", TaskState.WAITING).state is TaskState.WAITING
    assert node.orders()[-1] == ("robot1", OrderKind.FORGOTTEN)
