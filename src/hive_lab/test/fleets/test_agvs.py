# SPDX-License-Identifier: BSD-3-Clause
"""An agent and a simulated AGV, which share nothing but messages, do the drives of the hive."""

import math

import pytest

from blackboard.domain.task import StepKind, TaskStep
from blackboard.robot.contact import Contact
from blackboard.robot.executor import CommandState
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.control.navigator import Navigator
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model
from simenv.simulation import Simulation
from simenv.world.world_file import load_world
from vda5050.agent.agv import Agv
from vda5050.agent.maker import Maker
from vda5050.agent.order_follower import Tolerance
from vda5050.protocol.codec import decode, encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.state import Connection, ConnectionState
from vda5050.protocol.topics import Address, Topic, parse_topic
from vda5050.protocol.versions import Version
from vda5050.simulated.agv import AgvSettings, SimulatedAgv
from vda5050.simulated.testing import SimenvBase

START = Pose(2.6, 2.0, 0.0)
CONTROL = 4  # steps of the simulation between two rounds of both ends


class Lab:
    """One AGV in the lab, its agent, and two queues between them."""

    def __init__(self, version):
        self.version, self.address = version, Address.of(version, "Acme", "agv1")
        self.simulation, model = Simulation(load_world("lab")), load_model("mir100")
        self.simulation.add_robot("agv1", model, START)
        self.to_agent, self.to_agv, self.cut = [], [], False
        self.orders = 0
        self.agv = SimulatedAgv(
            AgvSettings(address=self.address, version=version, map_id="map"),
            model,
            SimenvBase(self.simulation, "agv1"),
            lambda name, payload, _qos, _kept: self.to_agent.append((name, payload)),
            lambda: self.now,
        )
        settings = NavigationSettings(settle=0.0)
        tolerance = Tolerance(settings.position_tolerance, settings.yaw_tolerance)
        planner = OmplPlanner(load_map("lab"), model.base.circumscribed_radius)
        self.agent = Agv(
            "agv1",
            model,
            Maker(),
            self._send,
            "p1",
            lambda: self.now,
            lambda _: None,
            tolerance,
            planner.field,
        )
        follower = self.agent.follower
        field = planner.field
        self.agent.use(Navigator("agv1", model, planner, follower, field, settings), field)
        self.agent.presence.note_broker(connected=True, now=0.0)
        self.agv.endpoint.report.connected()
        self.results = []
        self.run(0.5)

    @property
    def now(self):
        return self.simulation.time

    @property
    def pose(self):
        return self.simulation.poses["agv1"]

    def _send(self, body):
        topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
        self.orders += topic is Topic.ORDER
        header = Header(self.orders, timestamp_of(self.now), self.version.text, "Acme", "agv1")
        self.to_agv.append((self.address.topic(topic), encode(header, body, self.version)))
        return True

    def run(self, seconds):
        for _ in range(round(seconds * 10)):
            if not self.cut:
                for name, payload in self.to_agv:
                    self.agv.hear(name, payload)
                for name, payload in self.to_agent:
                    self.agent.hear(decode(payload, parse_topic(name)[1], self.version).body)
            self.to_agv.clear()
            self.to_agent.clear()
            self.agv.step(self.now)
            self.said = self.agent.tick(self.now, Neighbourhood())
            for _ in range(CONTROL):
                self.simulation.step()

    def cut_off(self):
        """Break the connection; the broker says the AGV's last will."""
        self.cut = True
        self.agent.hear(Connection(ConnectionState.CONNECTION_BROKEN))

    def expect_success(self, within=120.0):
        end = self.now + within
        while not self.results:
            assert self.now < end, (self.agent.keeper.phase, self.agent.keeper.failure)
            self.run(0.1)
        assert self.results.pop().state is CommandState.SUCCEEDED


@pytest.fixture(params=list(Version), ids=lambda version: version.value)
def lab(request):
    return Lab(request.param)


def test_the_agent_sends_the_agv_through_both_rooms_and_back(lab):
    for goal in (Pose(7.4, 8.6, 1.57), Pose(14.0, 5.4, 0.0), Pose(2.6, 2.0, 3.0)):
        lab.agent.drive(goal, lab.results.append)
        lab.expect_success()
        assert lab.pose.distance_to(goal) < 0.2
        assert abs(math.remainder(lab.pose.yaw - goal.yaw, math.tau)) < 0.2
    assert lab.simulation.collisions == 0
    assert not lab.agv.vehicle.order_errors


def test_the_agent_has_the_agv_pick_and_drop_a_load_of_its_task(lab):
    for kind in (StepKind.PICK, StepKind.PLACE):
        lab.agent.handle(TaskStep(kind, START, 2.0, "T1"), lab.results.append)
        lab.expect_success()
        loads = [load.load_id for load in lab.agv.workshop.loads]
        assert loads == (["T1"] if kind is StepKind.PICK else [])


def test_a_new_goal_cancels_the_order_for_the_old_one(lab):
    lab.agent.drive(Pose(14.0, 5.4, 0.0), lab.results.append)
    lab.run(3.0)
    first = lab.agv.vehicle.book.order_id
    lab.agent.drive(Pose(2.6, 4.0, 0.0), lab.results.append)
    lab.expect_success()

    assert lab.agv.vehicle.book.order_id != first
    assert lab.pose.distance_to(Pose(2.6, 4.0)) < 0.2
    assert lab.results == []


def test_cut_off_the_agv_drives_no_further_than_was_released_and_goes_on_later(lab):
    lab.agent.drive(Pose(14.0, 5.4, 0.0), lab.results.append)
    lab.run(4.0)
    end = lab.agv.vehicle.book.base[-1].node_position
    lab.cut = True
    lab.run(15.0)
    assert lab.pose.distance_to(Pose(end.x, end.y)) < 0.1
    lab.cut = False
    lab.expect_success()
    assert lab.simulation.collisions == 0


def test_an_agv_that_is_cut_off_is_lost_no_sooner_than_it_stands_at_the_end_of_its_base(lab):
    lab.agent.drive(Pose(14.0, 5.4, 0.0), lab.results.append)
    lab.run(4.0)
    lab.cut_off()
    while lab.agent.contact(lab.now) is Contact.BROKEN:
        before = lab.pose
        lab.run(1.0)

    assert lab.agent.contact(lab.now) is Contact.LOST
    assert lab.pose.distance_to(before) < 0.01
    assert lab.results == []


@pytest.mark.parametrize("stops", [False, True])
def test_an_agv_that_is_lost_claims_its_base_until_it_has_told_where_it_is(lab, stops):
    lab.agent.drive(Pose(14.0, 5.4, 0.0), lab.results.append)
    lab.run(4.0)
    lab.cut = True
    if stops:  # a cancellation that does not come through takes nothing back
        lab.agent.stop()
        lab.run(0.3)
    lab.cut_off()
    lab.run(20.0)
    said = lab.said
    claimed = [point for point, mark in zip(*said.samples, strict=True) if mark <= said.claim]

    assert said.stationary
    assert said.time == pytest.approx(lab.now, abs=0.2)
    assert min(math.dist(point, lab.pose[:2]) for point in claimed) < 0.3
    lab.cut = False
    lab.agv.endpoint.report.connected()
    lab.run(1.0)
    assert lab.agent.contact(lab.now) is Contact.KEPT
    assert lab.said.path[0] == pytest.approx(lab.pose[:2], abs=0.5)


def test_a_word_that_the_agv_is_back_is_not_enough_to_know_where_it_is(lab):
    lab.cut_off()
    lab.agent.hear(Connection(ConnectionState.ONLINE))

    assert lab.agent.contact(lab.now) is Contact.BROKEN
    lab.cut = False
    lab.run(1.0)  # it is asked for its state
    assert lab.agent.contact(lab.now) is Contact.KEPT
