# SPDX-License-Identifier: BSD-3-Clause
"""Executes the steps of one task without blocking, as one state machine (the report's Controller).

Every step goes through a `Command`; on ROS these are actionlib clients (`ros.commands`). A command
that fails is retried before the task is given up, because most failed drives resolve by
themselves: somebody stood in the way.

Between a drive and the arm's work at its end, a robot may have to move aside for another. So the
controller checks where the robot is before the arm begins, and drives back if need be.

`TRANSITIONS` is total: every state answers every event, so whatever comes late or twice changes
nothing. A transition comes before its effects, and the callbacks come last of all: they find the
machine at rest and may stop it or give it another task.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum, auto
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

from blackboard.domain.task import StepKind, split_task
from blackboard.errors import JournalError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.domain.settings import ControllerSettings
    from blackboard.domain.talker import Clock, Timer
    from blackboard.domain.task import Task, TaskStep
    from hive_common.pose import Pose


DISPLACEMENT = 0.3
"""A robot further than this from where its arm is to work drives back first [m]. The distance is
more than a drive's tolerance and the age of a pose explain, and less than a robot moves aside
(`hive_navigation.traffic.passing_place.DISTANCES`)."""


class CommandState(Enum):
    """How a command ended, in actionlib's words."""

    SUCCEEDED = "succeeded"  # done as asked
    PREEMPTED = "preempted"  # stopped because somebody else asked for it
    ABORTED = "aborted"  # the robot tried and gave up
    REJECTED = "rejected"  # the robot did not try
    LOST = "lost"  # the action server does not answer
    OCCUPIED = "occupied"  # the arm still holds the load of another task
    GONE = "gone"  # the action server has ended or is silent; trying again would only take time


@dataclass(frozen=True, slots=True)
class CommandResult:
    """How a command ended, and why in words."""

    state: CommandState
    text: str = ""
    begun: bool = True  # whether the robot may have moved


_SUCCESS = CommandResult(CommandState.SUCCEEDED)


def _nothing() -> None:
    """Do nothing."""


class Command(Protocol):
    """Makes the robot do one kind of step."""

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step; `done` is called once, from the talker's thread, unless cancelled."""

    def cancel(self) -> None:
        """Stop, also what an earlier process has begun. `done` is not called any more."""


class State(Enum):
    """What the controller is doing."""

    IDLE = auto()  # it has no task
    READY = auto()  # it is between two steps
    DRIVING = auto()  # the robot drives to the goal of a step
    RETURNING = auto()  # the robot drives back to where its arm is to work
    ACTING = auto()  # the arm works
    RETRYING = auto()  # it pauses before it retries a step
    HALTED = auto()  # it has begun a task and may not work


class Event(Enum):
    """What can happen to a controller."""

    START = auto()  # it is given a task
    DRIVE = auto()  # the next step is a drive
    ACT = auto()  # the next step is the arm's, and the robot is in place
    DISPLACED = auto()  # the next step is the arm's, and the robot is somewhere else
    COMPLETED = auto()  # no step is left
    SUCCEEDED = auto()  # the command succeeded
    FAILED = auto()  # the command failed, and attempts are left
    GAVE_UP = auto()  # the command failed, and no attempt is left
    TIMED_OUT = auto()  # the pause before a retry is over
    HALT = auto()  # the robot may not work now, for example because its lease ended
    RESUME = auto()  # the robot may work now
    STOP = auto()  # the task is dropped


_NOTHING: dict[Event, State | None] = dict.fromkeys(Event)
_AT_WORK = _NOTHING | {
    Event.SUCCEEDED: State.READY,
    Event.FAILED: State.RETRYING,
    Event.GAVE_UP: State.IDLE,
    Event.HALT: State.HALTED,
    Event.STOP: State.IDLE,
}

TRANSITIONS: Mapping[State, Mapping[Event, State | None]] = MappingProxyType(
    {
        State.IDLE: _NOTHING | {Event.START: State.READY},
        State.READY: _NOTHING
        | {
            Event.DRIVE: State.DRIVING,
            Event.ACT: State.ACTING,
            Event.DISPLACED: State.RETURNING,
            Event.COMPLETED: State.IDLE,
            Event.HALT: State.HALTED,
            Event.STOP: State.IDLE,
        },
        State.DRIVING: _AT_WORK,
        State.RETURNING: _AT_WORK | {Event.SUCCEEDED: State.ACTING},
        # Nobody can tell what a gripper that was stopped half-way holds.
        State.ACTING: _AT_WORK | {Event.HALT: None},
        State.RETRYING: _NOTHING
        | {Event.TIMED_OUT: State.READY, Event.HALT: State.HALTED, Event.STOP: State.IDLE},
        State.HALTED: _NOTHING | {Event.RESUME: State.READY, Event.STOP: State.IDLE},
    }
)
"""The next state for every state and event; None where the event changes nothing."""

_NOT_TAKEN = {CommandState.ABORTED, CommandState.REJECTED, CommandState.OCCUPIED}
"""How a pick ends of which the arm says that the load is where it was."""

_NO_USE = {CommandState.GONE, CommandState.OCCUPIED}
"""How a command ends that is not worth another attempt."""

_WORKING = (State.DRIVING, State.RETURNING, State.ACTING)


@dataclass
class _Run:
    """One task under way, `step` and `attempts` (at that step) as they stand."""

    task: Task
    step: int
    on_step: Callable[[int], None]
    on_end: Callable[[CommandResult], None]
    may_go: Callable[[], bool]
    attempts: int = 0

    @property
    def steps(self) -> tuple[TaskStep, ...]:
        return split_task(self.task)


class Controller:
    """Executes one task at a time, with a command for each kind of step.

    Attributes:
        missing: Says what keeps it from working at all, such as an action server that has ended;
            empty while nothing does.
    """

    def __init__(
        self,
        commands: Mapping[StepKind, Command],
        clock: Clock,
        settings: ControllerSettings,
        missing: Callable[[], str] = str,
    ) -> None:
        self.missing = missing
        self._commands = commands
        self._clock = clock
        self._settings = settings
        self._run: _Run | None = None
        self._command: Command | None = None
        self._started = 0
        self._has_driven = False
        self._pause: Timer | None = None
        self._here: Callable[[], Pose] | None = None
        self._time_step: Callable[[TaskStep], Callable[[], None]] = lambda _: _nothing
        self._timed: Callable[[], None] = _nothing
        self._before_step: Callable[[int, TaskStep], TaskStep] = lambda _, step: step
        self._on_miss: Callable[[Task, bool], None] = lambda *_: None
        self.state = State.IDLE

    @property
    def task_id(self) -> str:
        """Id of the task that has begun and not ended; empty if there is none."""
        return self._run.task.id if self._run is not None else ""

    def observe(
        self,
        here: Callable[[], Pose],
        time_step: Callable[[TaskStep], Callable[[], None]] = lambda _: _nothing,
    ) -> None:
        """Check from now on where the robot is before its arm begins, and time its steps.

        `time_step` is called with every step of a task that begins, and what it returns once the
        step has succeeded.
        """
        self._here, self._time_step = here, time_step

    def handle_loads(
        self,
        before_step: Callable[[int, TaskStep], TaskStep],
        on_miss: Callable[[Task, bool], None],
    ) -> None:
        """Let the robot follow its loads.

        `before_step` gets the number of a step and the step before it begins, and returns the step
        as the arm is asked for it; it raises JournalError if the step must not begin. `on_miss`
        is called with the task whose load was not picked, and whether the arm says so.
        """
        self._before_step, self._on_miss = before_step, on_miss

    def run(
        self,
        task: Task,
        first_step: int,
        on_step: Callable[[int], None],
        on_end: Callable[[CommandResult], None],
        may_go: Callable[[], bool] = lambda: True,
    ) -> None:
        """Execute a task; whatever is under way is stopped first.

        `on_step` is called with the number of steps done, whenever one is; `on_end` once with the
        last result, unless the task is stopped. `may_go` says whether the next step may begin, or
        go on, now.
        """
        self.stop()
        self._run = _Run(task, first_step, on_step, on_end, may_go)
        self._handle(Event.START)

    def go_on(self) -> None:
        """Halt or resume, as `may_go` says now; an arm finishes its step before it halts."""
        if self._run is not None:
            self._handle(Event.RESUME if self._run.may_go() else Event.HALT)

    def stop(self) -> None:
        """Drop the task; nothing more is reported of it."""
        self._handle(Event.STOP)

    def stop_arm(self) -> None:
        """Have the arm stop what an earlier process of this robot may have begun."""
        command = self._commands.get(StepKind.PICK)
        if command is not None and self.state is not State.ACTING:
            command.cancel()

    def stop_base(self) -> None:
        """Have the base stop a drive that an earlier process of this robot may have begun."""
        command = self._commands.get(StepKind.MOVE)
        if command is not None and not self._has_driven and self.state not in _WORKING:
            command.cancel()

    def _handle(self, event: Event, result: CommandResult = _SUCCESS) -> None:
        run, before, after = self._run, self.state, TRANSITIONS[self.state][event]
        if run is None or after is None:
            return
        self.state = after
        self._exit(before, event)
        if event is Event.SUCCEEDED and after is State.READY:
            run.step, run.attempts = run.step + 1, 0
            timed = self._timed
            run.on_step(run.step)
            timed()
        if after is State.READY and self.state is State.READY:
            self._handle(self._next_event(run))
        elif after in _WORKING:
            if before is State.READY:
                run.attempts += 1
            self._start_command(run, after)
        elif after is State.RETRYING:
            delay = self._settings.retry_delay
            self._pause = self._clock.after(delay, lambda: self._handle(Event.TIMED_OUT))
        elif after is State.HALTED:
            run.attempts = 0
        elif after is State.IDLE:
            self._run = None
            if event is not Event.STOP:
                run.on_end(result)

    def _exit(self, state: State, event: Event) -> None:
        """End what a state has under way."""
        if event in {Event.HALT, Event.STOP}:
            if state in _WORKING and self._command is not None:
                self._command.cancel()
            elif state is State.RETRYING and self._pause is not None:
                self._pause.cancel()

    def _next_event(self, run: _Run) -> Event:
        """Return how the task goes on from `READY`."""
        if run.step == len(run.steps):
            return Event.COMPLETED
        if not run.may_go():
            return Event.HALT
        step = run.steps[run.step]
        if step.kind is StepKind.MOVE:
            return Event.DRIVE
        return Event.DISPLACED if self._is_away_from(step.goal) else Event.ACT

    def _is_away_from(self, goal: Pose) -> bool:
        return self._here is not None and self._here().distance_to(goal) > DISPLACEMENT

    def _start_command(self, run: _Run, state: State) -> None:
        step = run.steps[run.step]
        if state is State.RETURNING:
            step = replace(step, kind=StepKind.MOVE, payload=0.0)
        self._command = self._commands.get(step.kind)
        if self._command is None:
            text = f"this robot has no command for {step.kind.name}"
            self._handle(Event.GAVE_UP, CommandResult(CommandState.REJECTED, text))
            return
        self._has_driven = self._has_driven or step.kind is StepKind.MOVE
        self._timed = self._time_step(step)
        self._started += 1
        number = self._started
        if state is not State.RETURNING:
            try:
                step = self._before_step(run.step, step)
            except JournalError as error:
                result = CommandResult(CommandState.ABORTED, str(error), begun=False)
                self._command_ended(number, result)
                return
        self._command.start(step, lambda result: self._command_ended(number, result))

    def _command_ended(self, number: int, result: CommandResult) -> None:
        if self._run is None or number != self._started:
            return
        if result.state is CommandState.SUCCEEDED:
            self._handle(Event.SUCCEEDED)
            return
        step = self._run.steps[self._run.step]
        looked = result.begun and result.state in _NOT_TAKEN
        acts = self.state is State.ACTING and step.kind is StepKind.PICK
        if acts and (looked or not result.begun):
            self._on_miss(self._run.task, looked)
        if self._run.attempts < self._settings.attempts and result.state not in _NO_USE:
            self._handle(Event.FAILED)
        else:
            self._handle(Event.GAVE_UP, result)
