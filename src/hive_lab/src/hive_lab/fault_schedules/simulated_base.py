# SPDX-License-Identifier: BSD-3-Clause
"""A robot's base, which drives on when the robot's process hangs or ends, as `move_base` does.

Only its drive guard stops it then, which is the real one. The guard and the navigation are
processes of their own; a machine that loses power stops all of them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.robot.drive_guard import Drive, DriveGuard
from blackboard.robot.executor import CommandResult, CommandState

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.task import TaskStep
    from hive_common.pose import Pose
    from hive_lab.fault_schedules.faulty_network import Host

_A_LITTLE = 1e-6
"""Least time to the next look [s]: less could be lost in the rounding of a clock's rate."""

_NOTICED = 1.0
"""So long after the end of the robot's process the guard has cancelled its drive [s]."""


class SimulatedBase:
    """One robot's base; it outlives the robot's process.

    Attributes:
        arrive: Called with the goal that the base has reached.
        at_work: Called with the step of a drive when it begins and when it ends.
        heads_for: Called with the goal of a drive when it begins, and with None when it ends.
    """

    def __init__(self, host: Host) -> None:
        self._host = host
        self._guard = DriveGuard()
        self._run = 0
        self._drive = Drive("move_base", "")
        self._step: TaskStep | None = None
        self._until = -math.inf
        self._tell: Callable[[CommandResult], None] = lambda _: None
        self._generation = 0
        self.arrive: Callable[[Pose], None] = lambda _: None
        self.at_work: Callable[[TaskStep, bool], None] = lambda *_: None
        self.heads_for: Callable[[Pose | None], None] = lambda _: None

    @property
    def drives(self) -> bool:
        """Whether it drives."""
        return self._step is not None

    def hold_until(self, end: float) -> None:
        """Let it drive until the end of the lease, by its host's clock [s]."""
        self._until = end
        if self.drives:
            self._guard.hold(self._drive, end)

    def start(
        self,
        step: TaskStep,
        duration: float,
        done: Callable[[CommandResult], None],
        *,
        works: bool,
    ) -> None:
        """Drive to the goal of a step, in place of the one before; it takes `duration` [s]."""
        self.cancel()
        self._step, self._tell, self._generation = step, done, self._host.generation
        self._drive = Drive("move_base", str(self._run))
        self._guard.hold(self._drive, self._until)
        self.at_work(step, True)
        self.heads_for(step.goal)
        self._host.network.schedule(duration, None, self._end, (self._run, step, works))
        self._watch(self._run)

    def cancel(self) -> None:
        """Stop."""
        self._run += 1
        self._guard.drop(self._drive)
        step, self._step = self._step, None
        if step is not None:
            self.at_work(step, False)
            self.heads_for(None)

    def process_ended(self) -> None:
        """Notice soon that the robot's process has ended."""
        self._host.network.schedule(_NOTICED, None, self._cancel_left, self._run)

    def _watch(self, run: int) -> None:
        """Let the guard look when the lease ends."""
        if run != self._run:
            return
        network, rate = self._host.network, self._host.rate
        if self._guard.due(network.now * rate):
            self._preempt()
        else:
            later = self._guard.next_due / rate - network.now
            network.schedule(max(later, _A_LITTLE), None, self._watch, run)

    def _cancel_left(self, run: int) -> None:
        if run == self._run and self._guard.left():
            self._preempt()

    def _preempt(self) -> None:
        self.cancel()
        self._finish(CommandResult(CommandState.PREEMPTED))

    def _end(self, what: tuple[int, TaskStep, bool]) -> None:
        run, step, works = what
        if run != self._run:
            return
        self.cancel()
        if works:
            self.arrive(step.goal)
        blocked = CommandResult(CommandState.ABORTED, "path blocked")
        self._finish(CommandResult(CommandState.SUCCEEDED) if works else blocked)

    def _finish(self, result: CommandResult) -> None:
        """Tell the process that has given the goal, if it still runs."""
        if self._generation == self._host.generation:
            self._host.network.schedule(0.0, self._host, self._tell, result)
