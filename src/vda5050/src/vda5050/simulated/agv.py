# SPDX-License-Identifier: BSD-3-Clause
"""One simulated AGV, put together: base, tools, the vehicle's side of the protocol, faults.

agv = SimulatedAgv(settings, model, base, send, wall)
agv.hear(topic, payload)      # from the broker
agv.step(now)                 # ten times a second or so
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from vda5050.simulated.base_drive import BaseDrive
from vda5050.simulated.mischief import Mischief
from vda5050.simulated.workshop import Workshop
from vda5050.vehicle.channel import Channel
from vda5050.vehicle.endpoint import Endpoint
from vda5050.vehicle.factsheet import factsheet_of
from vda5050.vehicle.rates import Rates
from vda5050.vehicle.vehicle import Identity, Vehicle

if TYPE_CHECKING:
    from collections.abc import Callable

    from robot_description.models import RobotModel
    from vda5050.protocol.codec import Body
    from vda5050.protocol.topics import Address, Topic
    from vda5050.protocol.versions import Version
    from vda5050.simulated.base_drive import Base


@attrs.frozen(kw_only=True)
class AgvSettings:
    """What one simulated AGV is called and speaks."""

    address: Address
    version: Version
    map_id: str
    rates: Rates = attrs.field(factory=Rates)
    charge: float = 1.0
    """How full its battery is at the start, 0..1."""


class SimulatedAgv:
    """An AGV on a base that takes velocities.

    Args:
        settings: What it is called and speaks.
        model: What it is.
        base: What it moves.
        send: Sends bytes on a topic, with a quality of service, retained or not.
        wall: Gives the time of headers [s since 1970].
    """

    def __init__(
        self,
        settings: AgvSettings,
        model: RobotModel,
        base: Base,
        send: Callable[[str, bytes, int, bool], object],
        wall: Callable[[], float],
    ) -> None:
        self._drive = BaseDrive(base, model.base)
        self.workshop = Workshop(model, settings.charge)
        self.channel = Channel(settings.address, settings.version, send, wall)
        identity = Identity(
            version=settings.version,
            map_id=settings.map_id,
            factsheet=factsheet_of(model, self.workshop, "VIRTUAL_LINE_GUIDED"),
        )
        self.vehicle = Vehicle(identity, self._drive, self.workshop)
        self.mischief = Mischief(self.vehicle, self._drive, self.workshop)
        self.endpoint = Endpoint(self.vehicle, self.channel, settings.rates, self._publish)
        self.mischief.report = self.endpoint.report
        self._now: float | None = None

    def hear(self, topic: str, payload: bytes) -> None:
        """Take in what came from the broker."""
        if not self.mischief.is_deaf:
            self.endpoint.hear(topic, payload)

    def step(self, now: float) -> None:
        """Go on; `now` [s] is the clock that the base moves by."""
        seconds = 0.0 if self._now is None else max(now - self._now, 0.0)
        self._now = now
        self.workshop.step(seconds, self._drive.velocity)
        self._drive.step(seconds)
        self.endpoint.step(now)
        self.mischief.release(now, self.channel.publish)

    def _publish(self, topic: Topic, body: Body) -> None:
        self.mischief.pass_on(self._now or 0.0, topic, body, self.channel.publish)
