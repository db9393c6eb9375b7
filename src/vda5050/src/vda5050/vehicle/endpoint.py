# SPDX-License-Identifier: BSD-3-Clause
"""A vehicle on its topics: what comes in reaches it, and what it tells goes out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vda5050.errors import MessageError
from vda5050.protocol.order import Order
from vda5050.vehicle.refusals import Cause, Refusal
from vda5050.vehicle.remote_control import RemoteControl
from vda5050.vehicle.report import Report

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.codec import Body
    from vda5050.protocol.topics import Topic
    from vda5050.vehicle.channel import Channel
    from vda5050.vehicle.rates import Rates
    from vda5050.vehicle.vehicle import Vehicle


class Endpoint:
    """Passes messages to a vehicle, and has it tell how it is.

    Args:
        vehicle: The vehicle.
        channel: Reads and writes its messages.
        rates: How often it tells.
        publish: Sends a message; None for the channel's own way.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        channel: Channel,
        rates: Rates,
        publish: Callable[[Topic, Body], None] | None = None,
    ) -> None:
        self.channel = channel
        self.report = Report(vehicle, rates, publish or channel.publish)
        self._vehicle = vehicle
        self._control = RemoteControl(vehicle, self.report.tell_state, self.report.tell_factsheet)

    def hear(self, topic: str, payload: bytes) -> None:
        """Take in what came from the broker; what is malformed is refused, not raised."""
        try:
            message = self.channel.read(topic, payload)
        except MessageError as error:
            about = (("topic", topic.rpartition("/")[2]),)
            self._vehicle.refuse(Refusal(Cause.MALFORMED, str(error)), about)
            return
        if isinstance(message, Order):
            self._vehicle.take(message)
        elif message is not None:
            self._control.act(message)

    def step(self, now: float) -> None:
        """Go on at a time [s]; the drive and the tools have done their step before."""
        self._vehicle.step()
        self.report.step(now)
