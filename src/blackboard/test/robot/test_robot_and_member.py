# SPDX-License-Identifier: BSD-3-Clause
"""A robot and the task list of the member beside it."""

from blackboard.consensus.task_list import TaskList
from blackboard.domain.record import OrderKind, TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.map_id import NO_MAP
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

A = Pose(6.0, 0.0)
GO = Task("T1", TaskType.GA, (A,))
WAITING, STARTED, DONE, FAILED = (
    TaskState.WAITING,
    TaskState.STARTED,
    TaskState.DONE,
    TaskState.FAILED,
)


class Beside:
    """The member beside a robot, as the test tells it to be; see `HiveFilter`."""

    hive = ""
    leader = carriers = None
    leaders_map = NO_MAP

    def __init__(self):
        self.asked = 0

    def obeys(self, _hive, _epoch):
        return True

    def follow(self, hear):
        self.tell = hear

    def show(self):
        self.asked += 1


def test_a_robot_beside_a_member_believes_its_member_and_not_bb_sync():
    member = Beside()
    harness = RobotHarness(hive_filter=member)
    harness.order(GO)
    harness.know(GO, TaskState.CANCELLED)
    meanwhile = harness.status.tasks

    cancelled = TaskRecord(GO, TaskState.CANCELLED, robot="robot1", assignment=1)
    member.tell(TaskList(1, 2, (cancelled,)))
    harness.wait()

    assert meanwhile == ("T1",)
    assert harness.status.tasks == ()


def test_a_robot_asks_its_member_for_the_list_with_every_status():
    member = Beside()
    harness = RobotHarness(hive_filter=member)

    harness.wait(3.0)

    assert member.asked == 3


def test_a_late_order_for_a_task_that_the_hive_has_forgotten_is_not_carried_out():
    member = Beside()
    harness = RobotHarness(hive_filter=member)
    harness.order(GO)
    harness.wait(STEP + 1.5)
    member.tell(TaskList(1, 3, (TaskRecord(GO, DONE, "robot1", 1, assignment=1),)))
    member.tell(TaskList(1, 4, (), earlier=1))

    harness.order(GO)

    assert harness.status.tasks == ()


def test_a_robot_drops_a_task_that_the_hive_has_forgotten():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(GO, assignment=2**32 - 1, kind=OrderKind.FORGOTTEN)

    assert harness.status.tasks == ()
    assert harness.command.running is None


def test_a_robot_stops_reporting_on_a_task_that_the_hive_has_forgotten():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP + 1.5)
    harness.order(GO, kind=OrderKind.FORGOTTEN)
    said = len(harness.reports(GO))
    harness.wait(5.0)

    assert harness.reports(GO)[said - 1] == (DONE, 1)
    assert len(harness.reports(GO)) == said


def test_a_report_on_a_later_task_than_the_forgotten_one_is_kept():
    harness = RobotHarness()
    harness.order(GO, assignment=3)
    harness.wait(STEP + 1.5)
    harness.order(GO, assignment=2, kind=OrderKind.FORGOTTEN)
    said = len(harness.reports(GO))
    harness.wait(5.0)

    assert len(harness.reports(GO)) > said


def test_an_old_order_to_forget_a_task_is_ignored():
    harness = RobotHarness()
    harness.order(GO)
    harness.order(GO, assignment=9, kind=OrderKind.FORGOTTEN, heard=-10.0)

    assert harness.status.tasks == ("T1",)


def test_a_forgotten_task_may_be_done_again_under_the_same_id():
    harness = RobotHarness()
    harness.order(GO)
    harness.wait(STEP + 1.5)
    harness.order(GO, kind=OrderKind.FORGOTTEN)
    harness.order(GO, assignment=2)

    assert harness.status.tasks == ("T1",)
