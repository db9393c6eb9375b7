# SPDX-License-Identifier: BSD-3-Clause
"""A load that nobody wants any more is put down where an operator says."""

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.task import StepKind, Task, TaskType
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=5.0)
GO = Task("T1", TaskType.GA, (A,))


@pytest.fixture
def harness():
    """A robot whose task was cancelled when its load was on board."""
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(2.5 * STEP)
    harness.order(CARRY, kind=OrderKind.TAKE_BACK)
    harness.command.started.clear()
    assert harness.status.state is RobotState.DEFECT
    assert harness.status.payload == 5.0
    return harness


def test_a_robot_brings_its_load_to_the_place_puts_it_down_and_takes_tasks_again(harness):
    harness.set_state("put_down 3 4 1.5")
    assert harness.status.reason == "brings the load of T2 to (3.00, 4.00)"

    harness.wait(2 * STEP + 1.0)

    drive, place = harness.command.started
    assert (drive.kind, drive.goal) == (StepKind.MOVE, Pose(3.0, 4.0, 1.5))
    assert (place.kind, place.goal, place.payload) == (StepKind.PLACE, Pose(3.0, 4.0, 1.5), 5.0)
    assert (harness.status.state, harness.status.payload) == (RobotState.IDLE, 0.0)

    harness.order(GO)
    harness.wait(STEP)
    assert harness.command.started[-1].goal == A


def test_the_arm_is_asked_with_one_id_and_looks_first_however_often_it_is_asked(harness):
    failure = CommandResult(CommandState.ABORTED, "slipped")
    harness.command.results = [CommandResult(CommandState.SUCCEEDED), failure]
    harness.set_state("put_down 3 4 0")
    harness.wait(3 * STEP + 5.0)

    asked = [(s.action, s.look) for s in harness.command.started if s.kind is StepKind.PLACE]
    assert asked == [("/T2/1/3", True)] * 2


def test_a_place_that_is_not_reached_leaves_the_load_on_board_and_can_be_changed(harness):
    failure = CommandResult(CommandState.ABORTED, "no way")
    harness.command.results = [failure, failure]
    harness.set_state("put_down 3 4 0")
    harness.wait(3 * STEP)

    assert harness.status.state is RobotState.DEFECT
    assert harness.status.reason == ("the load of T2 (5 kg) is still on board: aborted: no way")
    harness.set_state("put_down 5 5 0")
    harness.wait(2 * STEP + 1.0)
    assert harness.status.state is RobotState.IDLE


def test_a_robot_that_was_out_of_service_before_stays_out_when_its_load_is_down():
    harness = RobotHarness()
    harness.order(CARRY)
    harness.wait(2.5 * STEP)
    harness.set_state("defect")

    harness.set_state("put_down 3 4 0")
    harness.wait(2 * STEP + 1.0)

    assert (harness.status.state, harness.status.payload) == (RobotState.DEFECT, 0.0)
    assert harness.status.reason == "defect, set by an operator"


def test_a_robot_that_is_taken_out_of_service_with_a_load_left_stays_out_when_it_is_down(
    harness,
):
    harness.set_state("defect")

    harness.set_state("put_down 3 4 0")
    harness.wait(2 * STEP + 1.0)

    assert (harness.status.state, harness.status.payload) == (RobotState.DEFECT, 0.0)


@pytest.mark.parametrize(
    ("word", "state", "on_board"),
    [("idle", RobotState.IDLE, 0.0), ("defect", RobotState.DEFECT, 5.0)],
)
def test_another_word_stops_the_drive_and_only_a_person_s_word_empties_the_robot(
    harness, word, state, on_board
):
    harness.set_state("put_down 3 4 0")
    harness.wait(STEP / 2)
    harness.set_state(word)
    harness.wait(2 * STEP)

    assert len(harness.command.started) == 1
    assert (harness.status.state, harness.status.payload) == (state, on_board)


@pytest.mark.parametrize("words", ["", " 3 4", " 3 4 x", " nan 4 0", " 1e9 4 0", " 1 2 3 4"])
def test_what_is_no_place_is_refused(harness, words):
    harness.set_state(f"put_down{words}")
    harness.wait(STEP)

    assert "allowed: put_down X Y YAW [m, m, rad]" in harness.talker.warnings[-1]
    assert harness.command.started == []
    assert harness.status.payload == 5.0


def test_a_robot_without_a_load_that_was_left_refuses():
    harness = RobotHarness()
    harness.set_state("put_down 3 4 0")

    assert "no load was left on board" in harness.talker.warnings[-1]
    assert harness.status.state is RobotState.IDLE


def test_a_robot_that_may_not_work_halts_with_its_load_until_it_may_again(harness):
    harness.set_state("put_down 3 4 0")
    harness.listener._robot_lease = 0.0  # noqa: SLF001  (nobody renews the lease any more)
    harness.wait(2 * STEP)
    assert harness.command.running is None
    assert (harness.status.state, harness.status.payload) == (RobotState.DEFECT, 5.0)

    harness.listener._robot_lease = 3.5  # noqa: SLF001  (as above)
    harness.wait(3 * STEP)
    assert (harness.status.state, harness.status.payload) == (RobotState.IDLE, 0.0)
