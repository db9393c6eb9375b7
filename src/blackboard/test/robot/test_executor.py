# SPDX-License-Identifier: BSD-3-Clause
"""How the controller executes the steps of a task, and what it does when one fails."""

from random import Random

import pytest

from blackboard.domain.settings import ControllerSettings
from blackboard.domain.task import StepKind, Task, TaskType
from blackboard.robot.executor import (
    TRANSITIONS,
    CommandResult,
    CommandState,
    Controller,
    Event,
    State,
)
from hive_common.pose import Pose
from hive_lab.virtual.hive import Network, NetworkTalker

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
        self.running = False
        self.done = None

    def start(self, step, done):
        def end(result):
            self.running = False
            done(result)

        self.started.append(step)
        self.running = True
        self.done = end

    def cancel(self):
        self.cancelled += 1
        self.running = False


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
        self.may_go = True
        self.steps, self.ends = [], []

    def stands_at(self, pose):
        self.controller.observe(lambda: pose)

    def run(self, task=CARRY, first_step=0, on_step=None):
        on_step = on_step or self.steps.append
        self.controller.run(task, first_step, on_step, self.ends.append, lambda: self.may_go)

    def bring_to(self, state):
        """Give the controller a task and bring it to a state in which it stays."""
        self.may_go = state is not State.HALTED
        self.stands_at(B if state is State.RETURNING else A)
        self.run(first_step=1 if state in {State.RETURNING, State.ACTING} else 0)
        if state is State.RETRYING:
            self.drive.done(FAILED)
        self.may_go = True

    def happen(self, event):
        self.controller._handle(event)  # noqa: SLF001  (some events only come from within)

    def commands(self):
        """Return (steps begun, commands cancelled)."""
        motors = (self.drive, self.arm)
        return sum(len(each.started) for each in motors), sum(each.cancelled for each in motors)


AT_WORK = {State.DRIVING, State.RETURNING, State.ACTING}
GOES_ON = {
    State.DRIVING: State.ACTING,
    State.ACTING: State.DRIVING,
    State.RETRYING: State.DRIVING,
    State.HALTED: State.DRIVING,
}
"""What follows `READY`, from each state to which `Bench.bring_to` leads."""
PAIRS = [
    (state, event) for state in State for event in Event if state not in {State.IDLE, State.READY}
]


def test_the_table_says_what_every_event_does_in_every_state():
    assert set(TRANSITIONS) == set(State)
    assert all(set(row) == set(Event) for row in TRANSITIONS.values())


def test_every_state_is_reached_from_idle_and_can_be_stopped():
    reached, ahead = set(), [State.IDLE]
    while ahead:
        state = ahead.pop()
        reached.add(state)
        ahead += {after for after in TRANSITIONS[state].values() if after} - reached

    assert reached == set(State)
    assert {row[Event.STOP] for row in TRANSITIONS.values()} == {State.IDLE, None}
    assert [state for state in State if TRANSITIONS[state][Event.STOP] is None] == [State.IDLE]


@pytest.mark.parametrize(("state", "event"), PAIRS)
def test_the_controller_does_what_the_table_says(state, event):
    bench = Bench()
    bench.bring_to(state)
    begun, cancelled = bench.commands()
    bench.happen(event)

    after = TRANSITIONS[state][event]
    if after is State.READY:  # where it does not stay
        after = GOES_ON[state]
    drops = state in AT_WORK and event in {Event.HALT, Event.STOP} and after is not None
    assert bench.controller.state is (after or state)
    assert bench.commands() == (begun + (after in AT_WORK), cancelled + drops)
    assert len(bench.ends) == (event is Event.GAVE_UP and state in AT_WORK)


@pytest.mark.parametrize("event", Event)
def test_without_a_task_no_event_does_anything(event):
    bench = Bench()
    bench.happen(event)

    assert bench.controller.state is State.IDLE
    assert bench.commands() == (0, 0)


@pytest.mark.parametrize("event", Event)
def test_between_two_steps_the_controller_does_what_the_table_says(event):
    bench = Bench()
    bench.stands_at(A)
    bench.run(on_step=lambda _: bench.happen(event))
    bench.drive.done(OK)

    after = TRANSITIONS[State.READY][event] or State.ACTING
    assert bench.controller.state is after
    assert bench.commands() == (1 + (after in AT_WORK), 0)
    assert len(bench.ends) == (event is Event.COMPLETED)


@pytest.mark.parametrize("seed", range(20))
def test_whatever_happens_one_command_runs_at_most_and_only_while_the_robot_may_work(seed):
    dice, bench = Random(seed), Bench(attempts=2)
    bench.stands_at(A)

    def finish():
        for motor in (bench.drive, bench.arm):
            if motor.running:
                motor.done(dice.choice([OK, OK, FAILED]))
                return

    def change_mind():
        bench.may_go = not bench.may_go
        bench.controller.go_on()

    def displace():
        bench.stands_at(dice.choice([A, B]))

    def begin():
        if not bench.controller.task_id or dice.random() < 0.2:
            bench.run()

    actions = [begin, bench.controller.stop, bench.controller.go_on, change_mind, displace]
    actions += [finish] * 15 + [lambda: bench.network.run(2.0)] * 3
    for _ in range(500):
        dice.choice(actions)()

        at_work = bench.controller.state in AT_WORK
        assert (bench.drive.running, bench.arm.running).count(True) == at_work
        assert bench.may_go or not bench.drive.running
    assert bench.steps
    assert bench.ends


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


def test_steps_that_are_done_are_skipped():
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


def test_a_step_that_fails_is_retried_after_a_pause():
    bench = Bench()
    bench.run(GO)
    bench.drive.done(FAILED)

    bench.network.run(2.9)
    before_the_pause_is_over = len(bench.drive.started)
    bench.network.run(0.2)

    assert before_the_pause_is_over == 1
    assert len(bench.drive.started) == 2
    assert not bench.ends


def test_a_step_that_may_not_be_retried_stays_undone_and_nothing_is_reported():
    bench = Bench()
    bench.run(GO)
    bench.drive.done(FAILED)
    bench.may_go = False
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


def test_each_step_has_attempts_of_its_own():
    bench = Bench(attempts=2)
    bench.run()
    for motor in (bench.drive, bench.arm):
        motor.done(FAILED)
        bench.network.run(3.0)
        motor.done(OK)

    assert bench.steps == [1, 2]
    assert not bench.ends


@pytest.mark.parametrize(
    "state",
    [CommandState.PREEMPTED, CommandState.ABORTED, CommandState.REJECTED, CommandState.LOST],
)
def test_a_step_that_failed_is_retried(state):
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


@pytest.mark.parametrize(
    ("state", "times"), [(State.IDLE, 1), (State.DRIVING, 1), (State.ACTING, 0)]
)
def test_an_arm_is_stopped_that_an_earlier_process_may_have_started(state, times):
    bench = Bench()
    if state is not State.IDLE:
        bench.bring_to(state)

    bench.controller.stop_arm()

    assert (bench.drive.cancelled, bench.arm.cancelled) == (0, times)


@pytest.mark.parametrize(("state", "times"), [(State.IDLE, 1), (State.DRIVING, 0)])
def test_a_base_is_stopped_that_an_earlier_process_may_have_started(state, times):
    bench = Bench()
    if state is not State.IDLE:
        bench.bring_to(state)

    bench.controller.stop_base()

    assert (bench.drive.cancelled, bench.arm.cancelled) == (times, 0)


def test_a_base_that_this_process_has_driven_stands_when_nothing_is_under_way():
    bench = Bench()
    bench.run()
    bench.controller.stop()
    before = bench.drive.cancelled

    bench.controller.stop_base()

    assert bench.drive.cancelled == before


def test_stopping_cancels_the_command_under_way_and_reports_nothing():
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


def test_a_stop_in_the_pause_ends_the_attempts():
    bench = Bench()
    bench.run(GO)
    bench.drive.done(FAILED)

    bench.controller.stop()
    bench.network.run(10.0)

    assert len(bench.drive.started) == 1


def test_stopping_an_idle_controller_is_harmless():
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


def test_the_callback_for_a_step_may_stop_the_task():
    bench = Bench()
    bench.controller.run(CARRY, 0, lambda _: bench.controller.stop(), bench.ends.append)

    bench.drive.done(OK)

    assert not bench.arm.started
    assert not bench.ends


def test_the_callback_for_the_end_may_begin_the_next_task():
    bench = Bench()
    bench.controller.run(GO, 0, bench.steps.append, lambda _: bench.run(CARRY))

    bench.drive.done(OK)

    assert [step.task_id for step in bench.drive.started] == ["T2", "T1"]


def test_a_robot_that_had_to_move_aside_drives_back_before_its_arm_begins():
    bench = Bench()
    bench.stands_at(Pose(1.0, 0.4))
    bench.run()
    bench.drive.done(OK)

    assert bench.controller.state is State.RETURNING
    assert [step.kind for step in bench.drive.started] == [StepKind.MOVE] * 2
    assert [step.goal for step in bench.drive.started] == [A, A]
    assert bench.arm.started == []

    bench.drive.done(OK)

    assert bench.controller.state is State.ACTING
    assert [step.kind for step in bench.arm.started] == [StepKind.PICK]
    assert bench.steps == [1]


def test_a_robot_that_stands_where_it_is_to_pick_does_not_drive_back():
    bench = Bench()
    bench.stands_at(Pose(1.1, 0.1))
    bench.run()
    bench.drive.done(OK)

    assert len(bench.drive.started) == 1
    assert [step.kind for step in bench.arm.started] == [StepKind.PICK]


def test_an_arm_that_was_moved_away_at_work_retries_at_the_place_of_its_step():
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


def test_a_drive_back_that_fails_counts_as_an_attempt_of_the_arm_s_step():
    bench = Bench(attempts=2)
    bench.stands_at(B)
    bench.run()
    bench.drive.done(OK)
    bench.drive.done(FAILED)
    bench.network.run(3.0)
    bench.drive.done(FAILED)

    assert bench.ends == [FAILED]
    assert bench.arm.started == []


def test_a_halt_stops_a_drive_at_once_and_resuming_begins_it_again():
    bench = Bench()
    bench.run()
    bench.may_go = False
    bench.controller.go_on()
    halted = bench.controller.state, bench.drive.cancelled
    bench.may_go = True
    bench.controller.go_on()

    assert halted == (State.HALTED, 1)
    assert [step.goal for step in bench.drive.started] == [A, A]


def test_an_arm_finishes_its_step_before_a_halt():
    bench = Bench()
    bench.run(first_step=1)
    bench.may_go = False
    bench.controller.go_on()
    at_work = bench.controller.state, bench.arm.cancelled
    bench.arm.done(OK)

    assert at_work == (State.ACTING, 0)
    assert bench.controller.state is State.HALTED
    assert bench.steps == [2]


def test_a_late_result_of_a_halted_drive_does_not_count_for_the_resumed_one():
    bench = Bench()
    bench.run()
    late = bench.drive.done
    bench.may_go = False
    bench.controller.go_on()
    bench.may_go = True
    bench.controller.go_on()
    late(OK)

    assert bench.controller.state is State.DRIVING
    assert bench.steps == []


def test_a_step_whose_action_server_has_ended_is_given_up_without_another_try():
    bench = Bench()
    gone = CommandResult(CommandState.GONE, "the action server move_base has ended")
    bench.run(GO)

    bench.drive.done(gone)

    assert bench.ends == [gone]
    assert len(bench.drive.started) == 1
    assert bench.controller.state is State.IDLE
