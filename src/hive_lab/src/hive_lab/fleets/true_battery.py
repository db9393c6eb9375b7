# SPDX-License-Identifier: BSD-3-Clause
"""What a simulated robot's battery really has, whatever the robot reckons."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.costing.cost import friction_force
from blackboard.domain.battery import Battery, MeasuredBattery

if TYPE_CHECKING:
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.task import StepKind


class TrueBattery(Battery):
    """The battery of one robot, which measures at once what is drawn from it.

    Attributes:
        measured: The same battery as the robot knows it.
        friction: How much harder its wheels turn than its characteristics say; 1.5 is half as
            hard again, as with a worn wheel.
    """

    def __init__(self, body: RobotCharacteristics) -> None:
        super().__init__(body.battery)
        self._body = body
        self.measured = MeasuredBattery(body.battery)
        self.friction = 1.0

    def update_level(self, energy: float) -> None:
        """Draw an energy [J], at least 0; the robot measures what is left."""
        super().update_level(energy)
        self.measured.measure(self.level)

    def charge(self, duration: float) -> None:
        """Charge for a time [s]; the robot measures what that gives."""
        super().charge(duration)
        self.measured.measure(self.level)

    def run(self, duration: float, distance: float, payload: float) -> None:
        """Draw what a while takes.

        Args:
            duration: How long it is [s].
            distance: What the robot drives meanwhile [m].
            payload: What it has on board [kg].
        """
        body = self._body
        force = self.friction * friction_force(body.friction_coefficient, body.mass + payload)
        self.update_level(force * distance + body.idle_power * duration)

    def grip(self, kind: StepKind) -> None:
        """Draw what the arm takes for a pick or a place."""
        self.update_level(self._body.arm_power * self._body.arm_time(kind))
