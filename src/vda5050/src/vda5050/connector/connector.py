# SPDX-License-Identifier: BSD-3-Clause
"""A `move_base` robot as a vehicle of VDA 5050, put together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from vda5050.connector.arm_tools import ArmTools
from vda5050.connector.goal_drive import GoalDrive
from vda5050.vehicle.endpoint import Endpoint
from vda5050.vehicle.factsheet import factsheet_of
from vda5050.vehicle.rates import Rates
from vda5050.vehicle.vehicle import Identity, Vehicle

if TYPE_CHECKING:
    from robot_description.models import RobotModel
    from vda5050.connector.arm_tools import ArmControl
    from vda5050.connector.goal_drive import Navigation
    from vda5050.protocol.versions import Version
    from vda5050.vehicle.channel import Channel


@attrs.frozen(kw_only=True)
class ConnectorSettings:
    """What the robot speaks."""

    version: Version
    map_id: str
    rates: Rates = attrs.field(factory=Rates)


class Connector:
    """One robot for one master.

    Args:
        settings: What it speaks.
        model: What the robot is.
        navigation: Drives it.
        arm: Its arm; None for a robot without one.
        channel: Writes and reads its messages.
    """

    def __init__(
        self,
        settings: ConnectorSettings,
        model: RobotModel,
        navigation: Navigation,
        arm: ArmControl | None,
        channel: Channel,
    ) -> None:
        base = model.base
        self.tools = ArmTools(model, arm)
        braking = base.max_speed**2 / (2 * base.acceleration)
        self._drive = GoalDrive(navigation, braking, base.max_speed)
        identity = Identity(
            version=settings.version,
            map_id=settings.map_id,
            factsheet=factsheet_of(model, self.tools, "AUTONOMOUS"),
        )
        self.vehicle = Vehicle(identity, self._drive, self.tools)
        self.endpoint = Endpoint(self.vehicle, channel, settings.rates)

    def hear(self, topic: str, payload: bytes) -> None:
        """Take in what came from the broker."""
        self.endpoint.hear(topic, payload)

    def step(self, now: float) -> None:
        """Go on at a time [s]; to be called ten times a second or so."""
        self._drive.step()
        self.endpoint.step(now)
