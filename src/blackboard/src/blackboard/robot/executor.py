# SPDX-License-Identifier: BSD-3-Clause
"""Executes the steps of one task, one after the other, without blocking (the report's Controller).

What a step needs from the robot stands behind the `Command` port: on ROS these are actionlib
clients (`ros.commands`). A command that fails is tried again a few times before the task is given
up, because most failures of a drive pass by themselves: somebody stood in the way.

Between a drive and what the arm does at its end, a robot may have had to move aside for another
one. So it is looked at where it stands before its arm begins, and it drives back where need be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import TYPE_CHECKING, Protocol

from blackboard.domain.task import StepKind, split_task

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.domain.settings import ControllerSettings
    from blackboard.domain.talker import Talker, Timer
    from blackboard.domain.task import Task, TaskStep
    from hive_common.pose import Pose


AWAY = 0.3
"""From here on a robot has to drive back before its arm begins [m]. It is further than where a
drive ends and what a pose that is heard a little late is off, and nearer than a robot moves aside
(`robot_navigation.traffic.passing_place.DISTANCES`)."""


class CommandState(Enum):
    """How a command ended, in actionlib's words."""

    SUCCEEDED = "succeeded"
    """Done as asked."""
    PREEMPTED = "preempted"
    """Stopped because somebody else asked for it."""
    ABORTED = "aborted"
    """The robot tried and gave up."""
    REJECTED = "rejected"
    """The robot did not try."""
    LOST = "lost"
    """The action server does not answer."""


@dataclass(frozen=True, slots=True)
class CommandResult:
    """How a command ended, and why in words."""

    state: CommandState
    text: str = ""


class Command(Protocol):
    """Makes the robot do one kind of step."""

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step; `done` is called once, from the talker's thread, unless cancelled."""

    def cancel(self) -> None:
        """Stop; harmless when nothing is going on. `done` is not called any more."""


class StepWatch(Protocol):
    """Is told of drives as they happen, to time them."""

    def begin(self, step: TaskStep) -> None:
        """Note that a drive begins."""

    def drop(self) -> None:
        """Note that what was begun was stopped, or is tried again: its time says nothing."""

    def end(self) -> None:
        """Note that what was begun has been done."""


class Controller:
    """Runs one task at a time.

    Args:
        commands: What makes the robot do each kind of step.
        talker: For the pause between two tries.
        settings: How patient it is.
    """

    def __init__(
        self,
        commands: Mapping[StepKind, Command],
        talker: Talker,
        settings: ControllerSettings,
    ) -> None:
        self._commands = commands
        self._talker = talker
        self._settings = settings
        self._run: _Run | None = None
        self._watch: StepWatch | None = None
        self._pose: Callable[[], Pose] | None = None

    @property
    def drives(self) -> bool:
        """Whether a drive is under way, or is to be tried again."""
        return self._run is not None and self._run.doing.kind is StepKind.MOVE

    def look_at(self, pose: Callable[[], Pose]) -> None:
        """Have it looked at from now on where the robot stands, before its arm begins."""
        self._pose = pose

    def watch(self, watch: StepWatch) -> None:
        """Have every drive timed from now on."""
        self._watch = watch

    def run(
        self,
        task: Task,
        first_step: int,
        on_step: Callable[[int], None],
        on_end: Callable[[CommandResult], None],
        may_try_again: Callable[[], bool] = lambda: True,
    ) -> None:
        """Execute a task; what was going on is stopped first.

        Args:
            task: A task that `analyze_task` has passed.
            first_step: The first step that is still to be done.
            on_step: Called with the number of steps done, whenever one is.
            on_end: Called once with the last result, unless the run is stopped.
            may_try_again: Asked before a step that has failed is tried again; where it says no,
                the run is stopped.
        """
        self.stop()
        steps = split_task(task)
        doing = steps[min(first_step, len(steps) - 1)]
        self._run = _Run(steps, first_step, doing, on_step, on_end, may_try_again)
        self._start_step(self._run)

    def stop(self) -> None:
        """Stop the robot; nothing is reported of this run any more."""
        run, self._run = self._run, None
        if run is None:
            return
        if self._watch is not None:
            self._watch.drop()
        if run.retry is not None:
            run.retry.cancel()
        if run.command is not None:
            run.command.cancel()

    def _start_step(self, run: _Run) -> None:
        if run.step == len(run.steps):
            self._end(run, CommandResult(CommandState.SUCCEEDED))
            return
        step = run.steps[run.step]
        run.tries += 1
        if step.kind is not StepKind.MOVE and self._is_away_from(step.goal):
            step = replace(step, kind=StepKind.MOVE, payload=0.0)
        self._do(run, step)

    def _is_away_from(self, goal: Pose) -> bool:
        if self._pose is None:
            return False
        here = self._pose()
        return math.dist((here.x, here.y), (goal.x, goal.y)) > AWAY

    def _do(self, run: _Run, step: TaskStep) -> None:
        run.doing = step
        command = self._commands.get(step.kind)
        if command is None:
            text = f"this robot has no command for {step.kind.name}"
            self._end(run, CommandResult(CommandState.REJECTED, text))
            return
        run.command = command
        if self._watch is not None and step is run.steps[run.step] and step.kind is StepKind.MOVE:
            self._watch.begin(step)
        command.start(step, lambda result: self._step_ended(run, result))

    def _step_ended(self, run: _Run, result: CommandResult) -> None:
        if run is not self._run:
            return
        if self._watch is not None:
            (self._watch.end if result.state is CommandState.SUCCEEDED else self._watch.drop)()
        if result.state is CommandState.SUCCEEDED and run.doing is not run.steps[run.step]:
            self._do(run, run.steps[run.step])
        elif result.state is CommandState.SUCCEEDED:
            run.step += 1
            run.tries = 0
            run.on_step(run.step)
            if run is self._run:
                self._start_step(run)
        elif run.tries < self._settings.attempts:
            run.retry = self._talker.after(
                self._settings.retry_delay, lambda: self._try_again(run)
            )
        else:
            self._end(run, result)

    def _try_again(self, run: _Run) -> None:
        if run.may_try_again():
            self._start_step(run)
        else:
            self._run = None

    def _end(self, run: _Run, result: CommandResult) -> None:
        self._run = None
        run.on_end(result)


@dataclass
class _Run:
    """One task on its way."""

    steps: tuple[TaskStep, ...]
    step: int
    doing: TaskStep
    on_step: Callable[[int], None]
    on_end: Callable[[CommandResult], None]
    may_try_again: Callable[[], bool]
    tries: int = 0
    command: Command | None = None
    retry: Timer | None = None
