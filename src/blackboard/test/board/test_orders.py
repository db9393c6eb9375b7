# SPDX-License-Identifier: BSD-3-Clause
"""Orders, and how lost ones are repeated."""

from dataclasses import replace

from blackboard.board.orders import Orders
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import ANY_ASSIGNMENT, Order, OrderKind, TaskRecord
from blackboard.domain.talker import TASK_ASSIGN
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import lone_node
from hive_lab.virtual.network import Network, NetworkTalker

TASK = Task("T1", TaskType.GAB, (Pose(1.0, 1.0), Pose(2.0, 2.0)))
HELD = TaskRecord(TASK, TaskState.ASSIGNED, robot="robot1", step=1, assignment=3)
STATUS = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, 0.0), 1.0)


class Desk:
    """Orders for the tasks of a list, and what was said."""

    def __init__(self, record=HELD):
        self.network = Network()
        talker = NetworkTalker(self.network, "blackboard")
        self.node = lone_node(talker)
        self.node.start()
        self.node.commit((record,), lambda: None)
        self.orders = Orders(talker, self.node, timeout=2.0)

    def said(self):
        return [message for topic, message in self.network.heard if topic == TASK_ASSIGN]


def test_an_order_names_robot_task_first_step_and_assignment():
    desk = Desk()
    desk.orders.give(HELD)

    assert desk.said() == [Order(TASK, "robot1", step=1, epoch=1, assignment=3, hive="hive1")]


def test_a_status_that_shows_the_task_answers_the_order():
    desk = Desk()
    desk.orders.give(HELD)
    desk.network.run(10.0)

    desk.orders.compare(replace(STATUS, tasks=("T1",)))

    assert len(desk.said()) == 1


def test_an_order_is_not_repeated_before_its_timeout():
    desk = Desk()
    desk.orders.give(HELD)
    desk.network.run(2.0)

    desk.orders.compare(STATUS)

    assert len(desk.said()) == 1


def test_an_order_that_the_status_does_not_show_in_time_is_repeated():
    desk = Desk()
    desk.orders.give(HELD)
    desk.network.run(2.1)

    desk.orders.compare(STATUS)
    desk.orders.compare(STATUS)

    assert desk.said() == [Order(TASK, "robot1", step=1, epoch=1, assignment=3, hive="hive1")] * 2


def test_another_robot_s_status_says_nothing_about_an_order():
    desk = Desk()
    desk.orders.give(HELD)
    desk.network.run(2.1)

    desk.orders.compare(replace(STATUS, robot_id="robot2"))

    assert len(desk.said()) == 1


def test_a_repeated_order_has_the_task_s_present_step():
    desk = Desk()
    desk.orders.give(HELD)
    desk.node.commit((replace(HELD, step=2),), lambda: None)
    desk.network.run(2.1)

    desk.orders.compare(STATUS)

    assert desk.said()[-1].step == 2


def test_an_order_for_a_task_that_no_robot_holds_is_not_repeated():
    desk = Desk()
    desk.orders.give(HELD)
    desk.orders.forget("T1")
    desk.network.run(2.1)

    desk.orders.compare(STATUS)

    assert len(desk.said()) == 1
    assert not desk.orders.given_to("robot1")


def test_a_task_is_taken_back_from_the_robot_that_has_it():
    desk = Desk()
    desk.orders.send(HELD, OrderKind.TAKE_BACK)

    assert desk.said() == [
        Order(TASK, "robot1", OrderKind.TAKE_BACK, step=1, epoch=1, assignment=3, hive="hive1")
    ]


def test_a_task_that_no_robot_has_is_not_taken_back():
    desk = Desk()
    desk.orders.send(replace(HELD, robot=""), OrderKind.TAKE_BACK)

    assert not desk.said()


def test_what_is_not_a_robot_s_own_is_taken_back_under_the_number_of_the_list():
    desk = Desk()

    assert not desk.orders.compare(replace(STATUS, robot_id="robot2", tasks=("T1",)))
    assert [(order.kind, order.assignment) for order in desk.said()] == [(OrderKind.TAKE_BACK, 3)]


def test_a_lost_robot_drops_what_is_not_its_own_whatever_its_number():
    desk = Desk()
    desk.orders.compare(replace(STATUS, robot_id="robot2", tasks=("T1",)), is_lost=True)

    assert [order.assignment for order in desk.said()] == [ANY_ASSIGNMENT]


STRAY = replace(STATUS, robot_id="robot2", tasks=("T1", "T9"))
"""The status of a robot that has a task of another and one that is on no list."""


def test_a_robot_is_not_told_with_each_status_to_drop_what_is_not_its_own():
    desk = Desk()
    for _ in range(20):
        desk.orders.compare(STRAY)
        desk.network.run(0.1)

    assert [order.task.id for order in desk.said()] == ["T1", "T9"]


def test_a_robot_that_does_not_drop_what_is_not_its_own_in_time_is_told_again():
    desk = Desk()
    for _ in range(3):
        desk.orders.compare(STRAY)
        desk.network.run(2.1)

    assert [order.task.id for order in desk.said()] == ["T1", "T9"] * 3


def test_a_task_that_was_just_taken_back_is_not_taken_back_again():
    desk = Desk()
    desk.orders.send(replace(HELD, robot="robot2"), OrderKind.TAKE_BACK)
    desk.orders.compare(replace(STRAY, tasks=("T1",)))

    assert len(desk.said()) == 1


def test_what_a_robot_has_again_after_it_was_dropped_is_taken_back_at_once():
    desk = Desk()
    for tasks in (("T1",), (), ("T1",)):
        desk.orders.compare(replace(STRAY, tasks=tasks))

    assert len(desk.said()) == 2


def test_another_assignment_of_a_task_is_taken_back_at_once():
    desk = Desk()
    desk.orders.compare(STRAY)
    desk.node.commit((replace(HELD, assignment=4),), lambda: None)
    desk.orders.compare(STRAY)

    assert [order.assignment for order in desk.said() if order.task.id == "T1"] == [3, 4]


def test_a_robot_that_has_become_lost_is_told_at_once_to_drop_whatever_it_has():
    desk = Desk()
    desk.orders.compare(STRAY)
    desk.orders.compare(STRAY, is_lost=True)

    assert [order.assignment for order in desk.said()][2:] == [ANY_ASSIGNMENT] * 2


def test_the_next_leader_tells_a_robot_at_once_to_drop_what_is_not_its_own():
    desk = Desk()
    desk.orders.compare(STRAY)
    desk.orders.resume([HELD])
    desk.orders.compare(STRAY)

    assert len(desk.said()) == 4


def test_the_tasks_that_a_robot_holds_are_known():
    desk = Desk()
    desk.orders.give(HELD)

    assert desk.orders.given_to("robot1") == (HELD,)
    assert desk.orders.given_to("robot2") == ()


def test_nothing_is_kept_of_a_robot_that_has_left():
    desk = Desk()
    desk.orders.give(HELD)
    desk.orders.compare(replace(STATUS, tasks=("T1",), sent=5.0))
    desk.orders.forget("T1")
    desk.orders.forget_robot("robot1")

    assert desk.orders._heard == {}  # noqa: SLF001  (what it keeps)
    assert "robot1" not in desk.orders._given  # noqa: SLF001  (as above)
