# SPDX-License-Identifier: BSD-3-Clause
"""A load is picked once and put down once, whatever becomes of the robot's process."""

import dataclasses

import pytest

from blackboard.consensus.journal import MemoryJournal
from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import Hold, Load, Order, OrderKind
from blackboard.domain.task import Task, TaskState, TaskType, split_task
from blackboard.errors import JournalError
from blackboard.robot.executor import CommandResult, CommandState
from blackboard.robot.loads import Loads
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness
from hive_lab.virtual.network import Network, NetworkTalker

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
CARRY = Task("T1", TaskType.GPAB, (A, B), payload=5.0)
URGENT = Task("U", TaskType.GA, (A,), priority=10)
OTHER = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
PICK, PLACE = split_task(CARRY)[1], split_task(CARRY)[3]
ORDER = Order(CARRY, "robot1", epoch=1, assignment=3, hive="hive1")


def loads_of(journal):
    return Loads(NetworkTalker(Network(), "robot1"), journal)


class Full(MemoryJournal):
    def save_hold(self, _):
        raise JournalError("no space left on device")


def test_what_an_arm_is_about_to_pick_is_written_down_first():
    journal = MemoryJournal()

    asked = loads_of(journal).begin(ORDER, 1, PICK)

    assert journal.hold == Hold((Load("T1", 5.0, "hive1", 3),))
    assert asked.action == "hive1/T1/3/1"


def test_the_same_action_has_the_same_id_after_a_restart_and_the_arm_looks_first():
    journal = MemoryJournal(hold=Hold(sure=True))
    first = loads_of(journal).begin(ORDER, 1, PICK)
    later = dataclasses.replace(ORDER, hive="hive2", assignment=1)

    again = loads_of(journal).begin(later, 1, PICK)

    assert (first.look, again.look) == (False, True)
    assert again.action == first.action


def test_a_robot_that_lost_its_disk_lets_its_arm_look_first():
    assert loads_of(MemoryJournal()).begin(ORDER, 1, PICK).look


def test_an_order_whose_pick_has_begun_tells_a_robot_without_its_disk_what_may_be_on_board():
    loads = loads_of(MemoryJournal())

    loads.expect(ORDER)
    assert not loads.has(CARRY)
    loads.expect(dataclasses.replace(ORDER, step=1))
    assert loads.has(CARRY)


def test_the_load_of_an_earlier_task_is_not_that_of_a_later_one_with_the_same_id():
    loads = loads_of(MemoryJournal())
    earlier = dataclasses.replace(CARRY, posted=100.0)
    later = dataclasses.replace(CARRY, posted=160.0)
    loads.begin(dataclasses.replace(ORDER, task=earlier), 1, PICK)

    assert loads.has(dataclasses.replace(earlier, posted=100.0000004))  # after its way by ROS
    assert not loads.has(later)
    assert [each.task_id for each in loads.others([later])] == ["T1"]


def test_a_load_that_was_written_down_without_a_stamp_is_known_by_its_id():
    loads = loads_of(MemoryJournal(hold=Hold((Load("T1", 5.0, "hive1", 3),))))

    assert loads.has(dataclasses.replace(CARRY, posted=160.0))


def test_a_load_that_is_put_down_is_on_board_no_more():
    journal = MemoryJournal()
    loads = loads_of(journal)
    loads.begin(ORDER, 1, PICK)
    loads.begin(ORDER, 3, PLACE)

    loads.end(CARRY)

    assert journal.hold == Hold(sure=True)


def test_a_request_that_never_reached_the_arm_says_nothing_of_the_one_before():
    loads = loads_of(MemoryJournal())
    loads.begin(ORDER, 1, PICK)
    loads.begin(ORDER, 1, PICK)

    loads.miss(CARRY, looked=False)
    assert loads.has(CARRY)
    loads.miss(CARRY, looked=True)
    assert not loads.has(CARRY)


def test_an_arm_does_not_move_while_its_robot_cannot_write():
    with pytest.raises(JournalError, match="no space left"):
        loads_of(Full()).begin(ORDER, 1, PICK)


def test_a_last_step_waits_for_a_disk_on_which_its_report_fits():
    journal = MemoryJournal()
    loads_of(journal).check_writable()

    with pytest.raises(JournalError, match="no space left"):
        loads_of(Full()).check_writable()


@pytest.mark.parametrize(
    ("result", "state"),
    [
        (CommandResult(CommandState.ABORTED, "the grip failed"), TaskState.WAITING),
        (CommandResult(CommandState.LOST, "no answer"), TaskState.FAILED),
        (CommandResult(CommandState.LOST, "no answer", begun=False), TaskState.WAITING),
    ],
)
def test_only_a_load_that_is_surely_not_on_board_is_left_to_another_robot(result, state):
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(STEP / 2)
    harness.command.results = [result, result]
    harness.wait(4 * STEP)

    assert harness.reports(CARRY)[-1] == (state, 1)


def test_a_robot_whose_arm_holds_another_load_hands_its_task_back_and_leaves_service():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(STEP / 2)
    what = "the load of task T9 is on board"
    harness.command.results = [CommandResult(CommandState.OCCUPIED, what)]
    harness.wait(2 * STEP)

    assert harness.reports(CARRY)[-1] == (TaskState.WAITING, 1)
    assert harness.status.state is RobotState.DEFECT
    assert harness.status.reason == f"{what}: take it off, then set the robot idle"


@pytest.mark.parametrize("kind", [OrderKind.ASSIGN, OrderKind.TAKE_BACK])
def test_an_arm_of_an_earlier_process_is_stopped_before_people_take_the_load_off(kind):
    harness, stopped = RobotHarness(), []
    cancel = harness.command.cancel

    def note_and_cancel():
        stopped.append(harness.command.running)
        cancel()

    harness.command.cancel = note_and_cancel
    harness.order(CARRY, step=1)  # Its pick began before this process did.
    harness.wait(STEP / 2)
    if kind is OrderKind.ASSIGN:
        harness.order(URGENT)
    else:
        harness.order(CARRY, kind=kind)
    harness.wait()

    assert harness.status.state is RobotState.DEFECT
    assert stopped[-1] is None  # The drive had been stopped already.


def test_a_robot_with_the_load_of_an_earlier_task_takes_no_later_one_with_its_id():
    harness = RobotHarness()
    earlier = dataclasses.replace(CARRY, posted=100.0)
    later = dataclasses.replace(CARRY, posted=160.0)
    harness.order(earlier, step=1)
    harness.wait(STEP / 2)
    harness.order(earlier, kind=OrderKind.TAKE_BACK)
    harness.wait()

    harness.order(later, assignment=3)
    harness.wait(STEP)

    assert harness.reports(later)[-1] == (TaskState.WAITING, 0)
    assert "on board" in harness.status.reason


def test_an_order_for_a_later_task_ends_an_earlier_one_with_its_id():
    harness = RobotHarness()
    earlier = Task("T1", TaskType.GAB, (A, B), posted=100.0)
    later = Task("T1", TaskType.GAB, (B, A), posted=160.0)
    harness.order(earlier)
    harness.wait(1.5 * STEP)

    harness.order(later, assignment=3)
    harness.wait(STEP / 4)

    assert harness.reports(later)[-1] == (TaskState.STARTED, 0)
    assert harness.command.running.goal == B


def test_a_robot_under_way_with_a_load_does_not_begin_a_later_task_with_the_same_id():
    harness = RobotHarness()
    earlier = dataclasses.replace(CARRY, posted=100.0)
    harness.order(earlier)
    harness.wait(2.5 * STEP)

    harness.order(dataclasses.replace(CARRY, posted=160.0), assignment=3)
    harness.wait(STEP)

    assert harness.reports(CARRY)[-1] == (TaskState.WAITING, 0)
    assert harness.status.state is RobotState.DEFECT
    assert "on board" in harness.status.reason


def test_a_restarted_robot_whose_load_is_of_an_earlier_task_leaves_service():
    later = dataclasses.replace(CARRY, posted=160.0)
    hold = Hold((Load("T1", 5.0, "", 1, 100.0),))
    harness = RobotHarness(journal=MemoryJournal(hold=hold))

    harness.order(later, assignment=3)
    harness.know(later, TaskState.ASSIGNED, assignment=3)
    harness.wait(STEP)

    assert harness.status.state is RobotState.DEFECT
    assert harness.reports(later)[-1] == (TaskState.WAITING, 0)
