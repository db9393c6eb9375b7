# SPDX-License-Identifier: BSD-3-Clause
"""Many simulated AGVs in one process, in a hall, at real time; each has its own connection."""

from __future__ import annotations

import itertools
import queue
import time
from typing import TYPE_CHECKING

from hive_lab.fleets.sites import hall
from robot_description.models import load_model
from simenv.simulation import STEP, Simulation
from vda5050.mqtt.link import BrokerSettings, Link, Will
from vda5050.protocol.topics import Address, Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.agv import AgvSettings, SimulatedAgv
from vda5050.simulated.testing import SimenvBase
from vda5050.vehicle.rates import Rates

if TYPE_CHECKING:
    from collections.abc import Callable

MODEL = "mir100"
VERSION = Version.V2_1
MAP = "hall"
MAKER = "Acme"
_APART = 2.0  # distance of two starts [m]
_ROWS = (2.0, 4.0, 12.5, 21.0, 23.0)  # y of the places between the racks [m]
_COLUMNS = 19
_CONTROL = 4  # steps of the simulation between two of the AGVs: 0.1 s


def places() -> list[tuple[float, float]]:
    """Return places of the hall where AGVs can stand side by side, frame map [m]."""
    columns = (_APART * (1 + column) for column in range(_COLUMNS))
    return list(itertools.product(columns, _ROWS))


def names(number: int) -> list[str]:
    """Return the names, and serial numbers, of so many AGVs."""
    return [f"agv{index + 1}" for index in range(number)]


def address_of(name: str) -> Address:
    """Return where an AGV is among the topics."""
    return Address.of(VERSION, MAKER, name)


class Yard:
    """So many AGVs, each telling its state so often.

    Attributes:
        heard: When each order came in first, by its id [s, monotonic].
    """

    def __init__(self, port: int, number: int, state_period: float) -> None:
        self._simulation = Simulation(hall().world)
        self._inbox: queue.Queue[Callable[[], None]] = queue.Queue()
        self.heard: dict[str, float] = {}
        rates = Rates(state_period=state_period, visualization_period=30.0)
        starts = places()[: number * 2 : 2]
        self._agvs = [
            self._agv(name, place, BrokerSettings(port=port), rates)
            for name, place in zip(names(number), starts, strict=True)
        ]

    def _agv(
        self, name: str, place: tuple[float, float], broker: BrokerSettings, rates: Rates
    ) -> tuple[SimulatedAgv, Link]:
        model, address = load_model(MODEL), address_of(name)
        self._simulation.add_robot(name, model, (*place, 0.0))
        links: list[Link] = []
        agv = SimulatedAgv(
            AgvSettings(address=address, version=VERSION, map_id=MAP, rates=rates),
            model,
            SimenvBase(self._simulation, name),
            lambda topic, payload, qos, kept: links[0].publish(topic, payload, qos, retain=kept),
            time.time,
        )

        def hear(topic: str, payload: bytes) -> None:
            now = time.monotonic()
            self._inbox.put(lambda: self._hear(agv, topic, payload, now))

        links.append(
            Link(
                broker,
                name,
                hear,
                lambda on: self._inbox.put(agv.endpoint.report.connected if on else _nothing),
                Will(*agv.channel.will),
            )
        )
        links[0].subscribe(agv.channel.heard)
        return agv, links[0]

    def _hear(self, agv: SimulatedAgv, topic: str, payload: bytes, now: float) -> None:
        agv.hear(topic, payload)
        if topic.endswith(Topic.ORDER.value):
            self.heard.setdefault(agv.vehicle.book.order_id, now)

    def run(self, ended: Callable[[], bool]) -> None:
        """Let the AGVs live at real time until it is over."""
        for _, link in self._agvs:
            link.start()
        due = time.monotonic()
        while not ended():
            due += STEP * _CONTROL
            self._listen(due)
            for agv, _ in self._agvs:
                agv.step(self._simulation.time)
            for _ in range(_CONTROL):
                self._simulation.step()
        for agv, link in self._agvs:
            agv.channel.say_goodbye()
            link.stop()

    def _listen(self, until: float) -> None:
        while (left := until - time.monotonic()) > 0:
            try:
                self._inbox.get(timeout=left)()
            except queue.Empty:
                return


def _nothing() -> None:
    """What is to be done when a connection is lost: it comes back by itself."""
