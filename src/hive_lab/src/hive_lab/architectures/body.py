# SPDX-License-Identifier: BSD-3-Clause
"""What a simulated robot really does, whoever tells it to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.costing.cost import friction_force
from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState
from hive_lab.fleets.reckoned_bodies import PER_DRIVE, PER_METRE, SPREAD
from hive_lab.fleets.true_battery import TrueBattery

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

    from blackboard.costing.grid_path_lengths import GridPathLengths
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.task import TaskStep
    from hive_common.pose import Pose
    from hive_lab.architectures.ledger import Ledger
    from hive_lab.fault_schedules.faulty_network import FaultyNetwork, Host

_TICK = 1.0  # time between two draws on the battery [s]
_SUCCESS = CommandResult(CommandState.SUCCEEDED)


@dataclass
class _Drive:
    """A drive to a goal.

    Attributes:
        goal: Where it goes [map frame].
        length: Of the whole path [m].
        left: How long it takes from where it began or stopped [s].
        since: When it began or went on there [s]; infinite while it is interrupted.
    """

    goal: Pose
    length: float
    left: float
    since: float = math.inf

    def stop(self, now: float) -> None:
        """Interrupt it."""
        self.left -= max(0.0, now - self.since)
        self.since = math.inf


class Body:
    """Wheels, arm and battery of one robot; see `blackboard.robot.executor.Command`.

    Its pose stays the same until it has arrived; a drive that is interrupted goes on where it
    stopped, unless it is to another goal. Drives take the time that they take in the simulator,
    and robots never block each other. What a drive takes differs from what is predicted by a
    random error, which is drawn drive by drive.

    Args:
        host: The process that drives it; it hears how steps end.
        characteristics: Of the robot.
        pose: Where it stands [map frame].
        lengths: How far it drives; nobody is charged for them.
        random: The source of errors, of this robot alone.
        ledger: Notes what is done.

    Attributes:
        pose: Where it is [map frame].
        battery: What it really has.
        drawn: The energy it has drawn [J].
        moved: Called on the host with the pose when it has arrived.
    """

    def __init__(
        self,
        host: Host,
        characteristics: RobotCharacteristics,
        pose: Pose,
        lengths: GridPathLengths,
        random: Generator,
        ledger: Ledger,
    ) -> None:
        self.pose = pose
        self.battery = TrueBattery(characteristics)
        self.drawn = 0.0
        self.moved: Callable[[Pose], None] = lambda _: None
        self._host = host
        self._network: FaultyNetwork = host.network
        self._characteristics = characteristics
        self._lengths = lengths
        self._random = random
        self._ledger = ledger
        self._run = 0
        self._drive: _Drive | None = None  # under way, or interrupted
        self._network.schedule(_TICK, None, self._stand)

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self._run += 1
        body, run = self._characteristics, self._run
        length, takes = 0.0, body.arm_time(step.kind)
        if step.kind is StepKind.MOVE:
            drive = self._drive_to(step.goal)
            length, takes = drive.length, drive.left
            drive.since = self._network.now

        def end(_: object) -> None:
            if run != self._run:
                return
            self.pose, self._drive = step.goal, None
            mass = body.mass + self._ledger.load_during(step)
            friction = friction_force(body.friction_coefficient, mass)
            self._draw(friction * length + body.arm_power * body.arm_time(step.kind))
            self._ledger.note(step, self._network.now)
            self._network.act(self._host, hear, None)

        def hear(_: object) -> None:
            self.moved(self.pose)
            done(_SUCCESS)

        self._network.schedule(takes, None, end)

    def cancel(self) -> None:
        """Stop."""
        self._run += 1
        if self._drive is not None:
            self._drive.stop(self._network.now)

    def _drive_to(self, goal: Pose) -> _Drive:
        """Return the drive to a goal, the one that was interrupted if there is one."""
        if self._drive is None or self._drive.goal != goal:
            length = self._lengths.length(self.pose, goal)
            chance = math.exp(SPREAD * float(self._random.standard_normal()))
            self._drive = _Drive(goal, length, (PER_DRIVE + PER_METRE * length) * chance)
        return self._drive

    def _stand(self, _: object) -> None:
        self._draw(self._characteristics.idle_power * _TICK)
        self._network.schedule(_TICK, None, self._stand)

    def _draw(self, energy: float) -> None:
        self.drawn += energy
        self.battery.update_level(energy)
