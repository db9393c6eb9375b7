# SPDX-License-Identifier: BSD-3-Clause
"""What one robot of a simulated fleet is, and how it is set up."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.domain.settings import RobotSettings
from blackboard.robot.charging import ChargingPlan
from hive_lab.virtual.hive import SMALL_ROBOT

if TYPE_CHECKING:
    from blackboard.domain.characteristics import RobotCharacteristics


@dataclass(frozen=True, slots=True)
class RobotKit:
    """What one robot is, and how it is set up.

    Attributes:
        characteristics: What its bids go by.
        settings: How it bids.
        charge: How full its battery is at the start, from 0 to 1.
        charging: Where and when it charges; without chargers its battery does not empty.
        stalls: Share of its steps that take many times as long as promised, from 0 to 1.
    """

    characteristics: RobotCharacteristics = SMALL_ROBOT
    settings: RobotSettings = field(default_factory=RobotSettings)
    charge: float = 1.0
    charging: ChargingPlan = field(default_factory=ChargingPlan)
    stalls: float = 0.0

    def __str__(self) -> str:
        body = self.characteristics
        charge = (
            f", battery {self.charge:.0%}, {len(self.charging.chargers)} chargers"
            if self.charging.chargers
            else ""
        )
        stalls = f", {self.stalls:.0%} of the steps stall" if self.stalls else ""
        return (
            f"carries {body.payload:g} kg, lifts {body.arm_payload:g} kg, {body.max_speed:g} m/s, "
            f"bids by {self.settings.cost_model}{charge}{stalls}"
        )
