# SPDX-License-Identifier: BSD-3-Clause
"""Estimated robots of a virtual fleet: a day of them passes in minutes.

Drives and grips take the time they take in the simulator; robots never block each other. A random
error keeps the robots' predictions from coming true by construction.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.random import Generator

    from blackboard.domain.task import TaskStep
    from blackboard.robot.executor import Command
    from fleet_manager.config.fleet_file import FleetRobot
    from hive_common.pose import Pose
    from hive_lab.fleets.virtual_fleet import VirtualFleet
    from hive_lab.virtual.network import Call

PER_DRIVE, PER_METRE = 3.5, 1.35
"""Duration of a drive in the lab, [s] and [s/m]: fitted to 60 drives of four models."""

SPREAD = 0.15  # standard deviation of a drive's relative error
TICK = 1.0  # time between two draws on the battery while driving [s]


class ReckonedBodies:
    """Bodies that stay in place until they have arrived; see `virtual_fleet.Bodies`."""

    def __init__(self, random: Generator) -> None:
        self._random = random

    def command(self, robot: FleetRobot, fleet: VirtualFleet) -> Mapping[StepKind, Command]:
        """Return a robot's command for each kind of step."""
        return dict.fromkeys(StepKind, _Body(robot.name, fleet, self._random))


class _Body:
    """One robot; see `blackboard.robot.executor.Command`."""

    def __init__(self, name: str, fleet: VirtualFleet, random: Generator) -> None:
        self._name = name
        self._fleet = fleet
        self._random = random
        self._call: Call | None = None

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        if step.kind is not StepKind.MOVE:
            time = self._fleet.characteristics[self._name].arm_time(step.kind)
            ok = CommandResult(CommandState.SUCCEEDED)
            self._call = self._fleet.network.schedule(time, lambda: done(ok))
            return
        length = self._fleet.path_lengths[self._name].length(
            self._fleet.robots[self._name].status.pose, step.goal
        )
        if math.isinf(length):
            result = CommandResult(CommandState.ABORTED, "there is no path")
            self._call = self._fleet.network.schedule(TICK, lambda: done(result))
            return
        chance = math.exp(SPREAD * float(self._random.standard_normal()))
        left = (PER_DRIVE + PER_METRE * length) * chance
        self._drive(left, length / left, step.goal, done)

    def cancel(self) -> None:
        """Stop."""
        if self._call is not None:
            self._call.cancel()

    def _drive(
        self, left: float, speed: float, goal: Pose, done: Callable[[CommandResult], None]
    ) -> None:
        """Drive on for the time that is left [s], at the mean speed [m/s]."""

        def go_on() -> None:
            robot = self._fleet.robots[self._name]
            robot.add_travel(speed * time)
            if left > time:
                self._drive(left - time, speed, goal, done)
                return
            robot.set_pose(goal)
            done(CommandResult(CommandState.SUCCEEDED))

        time = min(left, TICK)
        self._call = self._fleet.network.schedule(time, go_on)
