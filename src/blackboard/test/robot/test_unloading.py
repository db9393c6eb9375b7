# SPDX-License-Identifier: BSD-3-Clause
"""A load that nobody wants any more is put down where an operator says."""

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.task import StepKind, Task, TaskType
from blackboard.robot.charging import ChargingPlan
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.harness import STEP, RobotHarness

A, B = Pose(6.0, 0.0), Pose(12.0, 0.0)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=5.0, posted=3.0)
OTHER = Task("T3", TaskType.GPAB, (A, B), payload=2.0)
GO = Task("T1", TaskType.GA, (A,))
CHARGERS = ChargingPlan({"charger 1": Pose(0.0, 0.0)})
LEFT = (
    "the load of T2 (5 kg) is on board: send the robot to put it down, or take it off, then set "
    "the robot idle"
)


def left_with_load(**fields):
    """Return a robot whose task was cancelled when its load was on board."""
    harness = RobotHarness(**fields)
    harness.order(CARRY)
    harness.wait(2.5 * STEP)
    harness.order(CARRY, kind=OrderKind.TAKE_BACK)
    harness.command.started.clear()
    assert harness.status.state is RobotState.DEFECT
    assert harness.status.payload == 5.0
    return harness


@pytest.fixture
def harness():
    return left_with_load()


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

    asked = [s for s in harness.command.started if s.kind is StepKind.PLACE]
    assert [(s.action, s.look) for s in asked] == [("/T2/1/3", True)] * 2
    assert [s.posted for s in asked] == [CARRY.posted] * 2


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


@pytest.mark.parametrize("plan", [None, CHARGERS], ids=["no chargers", "chargers"])
def test_a_robot_with_a_load_left_is_not_sent_to_charge_and_goes_on_with_what_it_does(plan):
    harness = left_with_load(charging=plan)
    harness.set_state("put_down 3 4 0")
    harness.wait(STEP / 2)
    harness.set_state("charge")
    warning = harness.talker.warnings[-1]
    harness.wait(2 * STEP)

    assert "robot1 cannot go to charge: " in warning
    assert [step.kind for step in harness.command.started] == [StepKind.MOVE, StepKind.PLACE]
    assert (harness.status.state, harness.status.payload) == (RobotState.IDLE, 0.0)


def test_a_robot_that_charges_where_it_stands_with_a_load_left_is_not_sent_to_a_charger():
    harness = left_with_load(charge=0.7, charging=CHARGERS)
    harness.set_state("charging")
    harness.set_state("charge")

    assert (
        f"robot1 cannot go to charge: it is out of service: {LEFT}" in harness.talker.warnings[-1]
    )
    assert harness.command.started == []


def test_a_trouble_stops_the_drive_and_lasts_until_the_robot_says_that_it_is_over(harness):
    harness.set_state("put_down 3 4 0")
    harness.wait(STEP / 2)
    harness.robot.note_trouble("a person controls it")
    harness.wait(3 * STEP)

    assert [step.kind for step in harness.command.started] == [StepKind.MOVE]
    assert harness.command.running is None
    assert (harness.status.state, harness.status.payload) == (RobotState.DEFECT, 5.0)
    assert harness.status.reason == f"a person controls it; {LEFT}"

    harness.set_state("put_down 3 4 0")
    assert "cannot put its load down: a person controls it" in harness.talker.warnings[-1]
    assert harness.command.running is None

    harness.robot.note_trouble("")
    assert (harness.status.state, harness.status.reason) == (RobotState.DEFECT, LEFT)
    harness.set_state("put_down 3 4 0")
    harness.wait(2 * STEP + 1.0)
    assert (harness.status.state, harness.status.payload) == (RobotState.IDLE, 0.0)


def test_an_empty_battery_stops_the_drive_until_an_operator_says_that_it_charges(harness):
    harness.set_state("put_down 3 4 0")
    harness.wait(STEP / 2)
    harness.battery.drop_to(0.0)
    harness.wait(3 * STEP)

    stranded = "stranded at (6.00, 0.00): its battery is empty"
    assert [step.kind for step in harness.command.started] == [StepKind.MOVE]
    assert harness.command.running is None
    assert (harness.status.state, harness.status.payload) == (RobotState.DEFECT, 5.0)
    assert harness.status.reason == f"{stranded}; {LEFT}"

    harness.set_state("put_down 3 4 0")
    assert f"cannot put its load down: {stranded}" in harness.talker.warnings[-1]
    assert harness.command.running is None

    harness.set_state("charging")
    assert (harness.status.state, harness.status.reason) == (RobotState.CHARGING, LEFT)


def test_a_robot_that_charged_where_it_stands_does_so_again_when_its_load_is_down():
    harness = RobotHarness(charge=0.9)
    harness.order(CARRY)
    harness.wait(2.5 * STEP)
    harness.set_state("charging")
    before = harness.battery.level
    harness.set_state("put_down 3 4 0")
    harness.wait(2 * STEP - 1.0)
    on_the_way = harness.battery.level
    harness.wait(2.0)

    assert on_the_way < before
    assert (harness.status.state, harness.status.payload) == (RobotState.CHARGING, 0.0)
    assert harness.status.reason == "charging, set by an operator"

    harness.wait(600.0)
    assert (harness.status.state, harness.status.charge > 0.99) == (RobotState.IDLE, True)


def test_a_robot_that_charged_on_its_own_goes_back_to_a_charger_when_its_load_is_down():
    harness = RobotHarness(charge=0.2, charging=CHARGERS)
    harness.wait(2.0)
    # The robot was under way with the load before its process restarted.
    harness.order(CARRY, step=1)
    before = harness.status
    harness.set_state("put_down 3 4 0")
    harness.wait(2 * STEP)
    harness.give_chargers(2, **{"charger 1": "robot1"})
    harness.wait(2 * STEP)

    assert (before.state, before.payload) == (RobotState.CHARGING, 5.0)
    assert before.reason == LEFT
    goals = [step.goal for step in harness.command.started]
    assert goals == [Pose(3.0, 4.0), Pose(3.0, 4.0), Pose(0.0, 0.0)]
    assert (harness.status.state, harness.status.payload) == (RobotState.CHARGING, 0.0)
    assert harness.status.reason.endswith("charges at charger 1")


def test_a_robot_whose_arm_holds_something_else_puts_nothing_down():
    harness = RobotHarness()
    done = CommandResult(CommandState.SUCCEEDED)
    occupied = CommandResult(CommandState.OCCUPIED, "the arm holds the load of T9")
    harness.command.results = [done, done, done, occupied]
    harness.order(CARRY)
    harness.wait(4 * STEP + 1.0)
    harness.command.started.clear()
    harness.set_state("put_down 3 4 0")

    assert "what is on board is not known" in harness.talker.warnings[-1]
    assert harness.command.started == []


def test_a_robot_with_the_loads_of_two_tasks_puts_nothing_down():
    harness = RobotHarness()
    # The robot was under way with both before its process restarted.
    harness.order(CARRY, step=1)
    harness.order(OTHER, step=1)
    harness.set_state("defect")
    harness.command.started.clear()
    harness.set_state("put_down 3 4 0")

    assert "what is on board is not known" in harness.talker.warnings[-1]
    assert harness.command.started == []
