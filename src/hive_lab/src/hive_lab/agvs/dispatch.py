# SPDX-License-Identifier: BSD-3-Clause
"""The agents of many AGVs in one process, which send them from place to place of the hall."""

from __future__ import annotations

import queue
import random
import time
from typing import TYPE_CHECKING

from hive_common.pose import Pose
from hive_lab.agvs.yard import MODEL, VERSION, address_of, names, places
from hive_lab.fleets.sites import hall
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.control.navigator import Navigator
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model
from vda5050.agent.agv import Agv
from vda5050.agent.body import with_own_scanners
from vda5050.agent.maker import Maker
from vda5050.agent.order_follower import Tolerance
from vda5050.mqtt.link import BrokerSettings, Link
from vda5050.protocol.codec import decode, encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.topics import Topic, parse_topic

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.robot.executor import CommandResult
    from vda5050.protocol.codec import Body

PERIOD = 0.1  # of a round of all agents [s]
_APART = 1.5  # distance of a goal from other goals and AGVs, along x plus along y [m]
_TOLD = (Topic.STATE, Topic.VISUALIZATION, Topic.CONNECTION, Topic.FACTSHEET)


class Dispatch:
    """So many agents on one connection; each AGV gets a new goal when it has come to its last.

    Attributes:
        given: When each AGV's goal was given, by the id of the first order for it [s, monotonic].
        reached: How many goals were reached.
        states: How many states came in.
        failed: Why others were not.
    """

    def __init__(self, port: int, number: int, seed: int = 1) -> None:
        self.given: dict[str, float] = {}
        self.reached = self.states = 0
        self.failed: list[str] = []
        self._random = random.Random(seed)
        self._inbox: queue.Queue[Callable[[], None]] = queue.Queue()
        self._headers = 0
        self._heard = Neighbourhood()
        self._goals: dict[str, tuple[float, float]] = {}
        self._waiting: dict[
            str, tuple[str, float]
        ] = {}  # the order before, and when the goal came
        self._link = Link(BrokerSettings(port=port), "dispatch", self._receive, self._changed)
        model, settings = with_own_scanners(load_model(MODEL)), NavigationSettings(settle=0.0)
        planner = OmplPlanner(hall().grid, model.base.circumscribed_radius)
        tolerance = Tolerance(settings.position_tolerance, settings.yaw_tolerance)
        self._agvs: dict[str, Agv] = {}
        for name in names(number):
            agv = Agv(
                name,
                model,
                Maker(),
                self._sender(name),
                name,
                time.monotonic,
                self.failed.append,
                tolerance,
                planner.field,
            )
            field = planner.field
            agv.use(Navigator(name, model, planner, agv.follower, field, settings), field)
            self._agvs[name] = agv
        topics = [address_of(name).topic(topic) for name in self._agvs for topic in _TOLD]
        self._link.subscribe(topics)

    def _sender(self, name: str) -> Callable[[Body], bool]:
        address = address_of(name)

        def send(body: Body) -> bool:
            topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
            self._headers += 1
            header = Header(
                self._headers,
                timestamp_of(time.time()),
                VERSION.text,
                address.manufacturer,
                address.serial,
            )
            return self._link.publish(address.topic(topic), encode(header, body, VERSION))

        return send

    def _receive(self, name: str, payload: bytes) -> None:
        self._inbox.put(lambda: self._hear(name, payload))

    def _hear(self, name: str, payload: bytes) -> None:
        found = parse_topic(name)
        if found is not None:
            self.states += found[1] is Topic.STATE
            self._agvs[found[0].serial].hear(decode(payload, found[1], VERSION).body)

    def _changed(self, on: bool) -> None:
        def note() -> None:
            for agv in self._agvs.values():
                agv.presence.note_broker(connected=on, now=time.monotonic())

        self._inbox.put(note)

    def run(self, ended: Callable[[], bool]) -> None:
        """Let the agents work until it is over."""
        self._link.start()
        due = time.monotonic()
        while not ended():
            due += PERIOD
            self._listen(due)
            for name, agv in self._agvs.items():
                self._round(name, agv)
        self._link.stop()

    def _listen(self, until: float) -> None:
        while (left := until - time.monotonic()) > 0:
            try:
                self._inbox.get(timeout=left)()
            except queue.Empty:
                return

    def _round(self, name: str, agv: Agv) -> None:
        self._tick(agv)
        before, at = self._waiting.get(name, ("", 0.0))
        if name in self._waiting and agv.keeper.order_id != before:
            self.given[agv.keeper.order_id] = at
            del self._waiting[name]
        if agv.pose is not None and name not in self._goals:
            self._send_away(name, agv)

    def _tick(self, agv: Agv) -> None:
        said = agv.tick(time.monotonic(), self._heard)
        if said is not None:
            self._heard.hear(said)

    def _send_away(self, name: str, agv: Agv) -> None:
        """Give an AGV a place that is nobody's."""
        taken = [*self._goals.values(), *(a.pose[:2] for a in self._agvs.values() if a.pose)]
        free = [
            place
            for place in places()
            if all(abs(place[0] - x) + abs(place[1] - y) > _APART for x, y in taken)
        ]
        self._goals[name] = goal = self._random.choice(free)
        self._waiting[name] = (agv.keeper.order_id, time.monotonic())

        def done(result: CommandResult) -> None:
            del self._goals[name]
            self.reached += result.state.name == "SUCCEEDED"
            if result.state.name != "SUCCEEDED":
                self.failed.append(f"{name}: {result.text}")

        agv.drive(Pose(*goal, 0.0), done)
        self._tick(agv)
