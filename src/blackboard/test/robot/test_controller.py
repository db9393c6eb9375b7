# SPDX-License-Identifier: BSD-3-Clause
"""How the steps of a task are executed, and what is done when one fails."""

import pytest

from blackboard.domain.settings import ControllerSettings
from blackboard.domain.task import StepKind, Task, TaskType
from blackboard.robot.controller import CommandResult, CommandState, Controller
from hive_common.pose import Pose
from hive_lab.virtual.network import Network, NetworkTalker

A, B = Pose(1.0, 0.0), Pose(2.0, 0.0)
CARRY = Task("T1", TaskType.GPAB, (A, B), payload=1.0)
GO = Task("T2", TaskType.GA, (B,))
OK = CommandResult(CommandState.SUCCEEDED)
FAILED = CommandResult(CommandState.ABORTED, "somebody stood in the way")


class Motor:
    """A command that ends when the test says so."""

    def __init__(self):
        self.started = []
        self.cancelled = 0
        self.done = None

    def start(self, step, done):
        self.started.append(step)
        self.done = done

    def cancel(self):
        self.cancelled += 1


class Bench:
    """A controller with commands in hand, and what it reports."""

    def __init__(self, kinds=StepKind, attempts=3):
        self.network = Network()
        self.drive, self.arm = Motor(), Motor()
        commands = {StepKind.MOVE: self.drive, StepKind.PICK: self.arm, StepKind.PLACE: self.arm}
        self.controller = Controller(
            {kind: commands[kind] for kind in kinds},
            NetworkTalker(self.network, "robot1"),
            ControllerSettings(attempts=attempts, retry_delay=3.0),
        )
        self.steps, self.ends = [], []

    def stands_at(self, pose):
        self.controller.look_at(lambda: pose)

    def run(self, task=CARRY, first_step=0, **asked):
        self.controller.run(task, first_step, self.steps.append, self.ends.append, **asked)


def test_the_steps_are_done_one_after_the_other_and_each_is_reported():
    bench = Bench()
    bench.run()
    for motor in (bench.drive, bench.arm, bench.drive, bench.arm):
        motor.done(OK)

    assert bench.steps == [1, 2, 3, 4]
    assert bench.ends == [OK]
    assert [step.goal for step in bench.drive.started] == [A, B]
    assert [step.kind for step in bench.arm.started] == [StepKind.PICK, StepKind.PLACE]


def test_a_step_begins_only_when_the_one_before_has_ended():
    bench = Bench()
    bench.run()

    assert len(bench.drive.started) == 1
    assert not bench.arm.started
    assert not bench.ends


def test_steps_that_are_done_are_left_out():
    bench = Bench()
    bench.run(first_step=2)
    bench.drive.done(OK)

    assert [step.goal for step in bench.drive.started] == [B]
    assert bench.steps == [3]


def test_a_task_that_is_done_already_ends_at_once():
    bench = Bench()
    bench.run(first_step=4)

    assert bench.ends == [OK]
    assert not bench.drive.started


def test_a_step_that_fails_is_tried_again_after_a_pause():
    bench = Bench()
    bench.run(GO)
    bench.drive.done(FAILED)

    bench.network.run(2.9)
    before_the_pause_is_over = len(bench.drive.started)
    bench.network.run(0.2)

    assert before_the_pause_is_over == 1
    assert len(bench.drive.started) == 2
    assert not bench.ends


def test_a_step_that_may_not_be_tried_again_stays_undone_and_nothing_is_reported():
    bench = Bench()
    bench.run(GO, may_try_again=lambda: False)
    bench.drive.done(FAILED)
    bench.network.run(3.1)

    assert len(bench.drive.started) == 1
    assert not bench.ends


def test_a_step_that_keeps_failing_ends_the_task_with_its_last_result():
    bench = Bench(attempts=3)
    bench.run(GO)
    for _ in range(3):
        bench.drive.done(FAILED)
        bench.network.run(3.0)

    assert len(bench.drive.started) == 3
    assert bench.ends == [FAILED]
    assert not bench.steps


def test_each_step_has_its_own_tries():
    bench = Bench(attempts=2)
    bench.run()
    for motor in (bench.drive, bench.arm):
        motor.done(FAILED)
        bench.network.run(3.0)
        motor.done(OK)

    assert bench.steps == [1, 2]
    assert not bench.ends


@pytest.mark.parametrize(
    "state", [state for state in CommandState if state is not CommandState.SUCCEEDED]
)
def test_whatever_is_no_success_is_tried_again(state):
    bench = Bench()
    bench.run(GO)

    bench.drive.done(CommandResult(state))
    bench.network.run(3.0)

    assert len(bench.drive.started) == 2


def test_a_robot_without_a_command_for_a_step_says_so():
    bench = Bench(kinds=[StepKind.MOVE])
    bench.run()
    bench.drive.done(OK)

    assert bench.ends == [
        CommandResult(CommandState.REJECTED, "this robot has no command for PICK")
    ]


def test_to_stop_cancels_the_command_under_way_and_reports_nothing():
    bench = Bench()
    bench.run()

    bench.controller.stop()

    assert (bench.drive.cancelled, bench.arm.cancelled) == (1, 0)
    assert not bench.ends


@pytest.mark.parametrize("late", [OK, FAILED])
def test_a_result_that_comes_after_the_stop_is_ignored(late):
    bench = Bench()
    bench.run()
    bench.controller.stop()

    bench.drive.done(late)
    bench.network.run(10.0)

    assert not bench.steps
    assert not bench.ends
    assert len(bench.drive.started) == 1


def test_a_stop_in_the_pause_ends_the_tries():
    bench = Bench()
    bench.run(GO)
    bench.drive.done(FAILED)

    bench.controller.stop()
    bench.network.run(10.0)

    assert len(bench.drive.started) == 1


def test_to_stop_when_nothing_is_going_on_is_harmless():
    bench = Bench()

    bench.controller.stop()

    assert bench.drive.cancelled == 0


def test_a_new_task_stops_the_old_one_whose_results_no_longer_count():
    bench = Bench()
    bench.run(CARRY)
    old = bench.drive.done
    bench.run(GO)

    old(OK)

    assert bench.drive.cancelled == 1
    assert not bench.steps
    bench.drive.done(OK)
    assert bench.ends == [OK]


def test_a_task_may_be_stopped_by_who_hears_of_its_step():
    bench = Bench()
    bench.controller.run(CARRY, 0, lambda _: bench.controller.stop(), bench.ends.append)

    bench.drive.done(OK)

    assert not bench.arm.started
    assert not bench.ends


def test_the_next_task_may_be_begun_by_who_hears_of_the_end():
    bench = Bench()
    bench.controller.run(GO, 0, bench.steps.append, lambda _: bench.run(CARRY))

    bench.drive.done(OK)

    assert [step.task_id for step in bench.drive.started] == ["T2", "T1"]


def test_a_robot_that_had_to_move_aside_drives_back_before_its_arm_begins():
    bench = Bench()
    bench.stands_at(Pose(1.0, 0.4))
    bench.run()
    bench.drive.done(OK)

    assert bench.controller.drives
    assert [step.kind for step in bench.drive.started] == [StepKind.MOVE] * 2
    assert [step.goal for step in bench.drive.started] == [A, A]
    assert bench.arm.started == []

    bench.drive.done(OK)

    assert not bench.controller.drives
    assert [step.kind for step in bench.arm.started] == [StepKind.PICK]
    assert bench.steps == [1]


def test_a_robot_that_stands_where_it_is_to_pick_does_not_drive_back():
    bench = Bench()
    bench.stands_at(Pose(1.1, 0.1))
    bench.run()
    bench.drive.done(OK)

    assert len(bench.drive.started) == 1
    assert [step.kind for step in bench.arm.started] == [StepKind.PICK]


def test_an_arm_that_was_moved_away_at_work_tries_again_where_it_is_to_pick():
    bench = Bench()
    bench.stands_at(A)
    bench.run()
    bench.drive.done(OK)
    bench.stands_at(Pose(1.0, -1.8))
    bench.arm.done(FAILED)
    bench.network.run(3.0)

    assert [step.goal for step in bench.drive.started] == [A, A]
    bench.drive.done(OK)
    assert [step.kind for step in bench.arm.started] == [StepKind.PICK] * 2


def test_a_drive_back_that_fails_counts_as_a_try_of_what_the_arm_was_to_do():
    bench = Bench(attempts=2)
    bench.stands_at(B)
    bench.run()
    bench.drive.done(OK)
    bench.drive.done(FAILED)
    bench.network.run(3.0)
    bench.drive.done(FAILED)

    assert bench.ends == [FAILED]
    assert bench.arm.started == []
