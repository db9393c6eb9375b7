# SPDX-License-Identifier: BSD-3-Clause
"""The lines along which an AGV is sent are clear, whenever and wherever it gets another goal."""

import itertools
import math
import random

import pytest
import shapely.geometry

from blackboard.robot.executor import CommandState
from hive_common.pose import Pose
from hive_navigation.control.follower import Room
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.control.navigator import Navigator
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.planning.path import Path
from hive_navigation.planning.planner import PlanError
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.models import load_model
from simenv.testing import SIDE, hall
from simenv.world.draw_map import draw_map
from simenv.world.shapes import Shape
from vda5050.agent.agv import Agv
from vda5050.agent.body import with_own_scanners
from vda5050.agent.maker import Maker
from vda5050.agent.order_follower import NARROW, PASSING, OrderFollower, Tolerance
from vda5050.agent.order_keeper import OrderKeeper
from vda5050.protocol.order import Order
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import MAP, Rig

ROUND = 0.1  # [s]


def shelves():
    """Return a hall with shelves, between which there is room for one AGV."""
    box = shapely.geometry.box
    rows = [
        Shape(f"shelf {x:g} {y:g}", box(x, y, x + 0.8, y + 1.4))
        for x in (2.6, 4.9, 7.1)
        for y in (2.4, 5.4)
    ]
    return hall(*rows)


class Pair:
    """A simulated AGV and its agent, without a broker between them."""

    def __init__(self, late=1):
        world = shelves()
        self.rig = Rig(Version.V2_0, late=late, world=world)
        self.model = with_own_scanners(load_model("mir100"))
        settings = self.settings = NavigationSettings(settle=0.0)
        self.orders, self.results = [], []
        self.agent = Agv(
            "agv",
            self.model,
            Maker(map_id=MAP),
            self._send,
            "p1",
            lambda: self.rig.simulation.time,
            lambda _: None,
            Tolerance(settings.position_tolerance, settings.yaw_tolerance),
            ClearanceField.of(draw_map(world)),
        )
        self.use(draw_map(world))
        self.agent.presence.note_broker(connected=True, now=0.0)
        self._heard = 0

    def _send(self, body):
        if isinstance(body, Order):
            self.orders.append(body)
        self.rig.send(body)
        return True

    def use(self, grid):
        """Have the agent plan on a map from now on."""
        self.planner = OmplPlanner(grid, self.model.base.circumscribed_radius)
        field, follower = self.planner.field, self.agent.follower
        navigator = Navigator("agv", self.model, self.planner, follower, field, self.settings)
        self.agent.use(navigator, field)

    def drive(self, goal):
        self.agent.drive(goal, self.results.append)

    def run(self, seconds):
        for _ in range(round(seconds / ROUND)):
            self.rig.run(ROUND)
            new, self._heard = self.rig.heard[self._heard :], len(self.rig.heard)
            for topic, body, _ in new:
                if topic in {Topic.STATE, Topic.VISUALIZATION, Topic.CONNECTION}:
                    self.agent.hear(body)
            self.agent.tick(self.rig.simulation.time, Neighbourhood())

    def free_place(self, dice):
        while True:
            x, y = dice.uniform(0.0, SIDE), dice.uniform(0.0, SIDE)
            if self.planner.field.at(x, y) >= self.planner.goal_need:
                return Pose(x, y, dice.uniform(-math.pi, math.pi))

    def is_clear(self, order):
        """Return whether all lines of an order are, as far as the AGV has room where it stands."""
        field = self.planner.field
        places = [(node.node_position.x, node.node_position.y) for node in order.nodes]
        need = min(self.model.base.circumscribed_radius, *(field.at(*place) for place in places))
        return all(field.line_is_clear(*line, need) for line in itertools.pairwise(places))


@pytest.mark.parametrize("seed", range(4))
def test_an_agv_whose_goal_changes_on_the_way_is_sent_along_clear_lines_and_touches_nothing(seed):
    dice, pair = random.Random(seed), Pair()
    pair.run(1.0)
    for _ in range(40):
        pair.drive(pair.free_place(dice))
        pair.run(dice.uniform(0.5, 8.0))
    pair.run(60.0)
    pair.drive(pair.free_place(dice))
    pair.run(60.0)
    assert len(pair.orders) > 40
    assert all(pair.is_clear(order) for order in pair.orders)
    assert not pair.rig.simulation.contacts
    assert pair.results
    assert all(result.state is CommandState.SUCCEEDED for result in pair.results)


def test_an_agv_may_pass_no_farther_from_a_node_than_there_is_room():
    pair = Pair()
    pair.run(1.0)
    pair.drive(Pose(4.0, 8.0, 0.0))
    pair.run(40.0)
    radius, at = pair.model.base.circumscribed_radius, pair.planner.field.at
    nodes = [node.node_position for order in pair.orders for node in order.nodes[1:]]
    passed = [node for node in nodes if node.theta is None]
    assert {node.allowed_deviation_xy.a for node in passed} >= {PASSING}
    for node in passed:
        room = at(node.x, node.y) - radius
        assert NARROW <= node.allowed_deviation_xy.a <= max(room, NARROW)


def beside_a_shelf(pose):
    """Return a follower, and the places of its order, that goes by a corner of a shelf."""
    sent = []
    follower = OrderFollower(
        load_model("mir100").base,
        OrderKeeper(lambda body: bool(sent.append(body)) or True, "p1"),
        lambda place: (place, MAP),
        lambda: 0.0,
        Tolerance(0.1, 0.1),
        ClearanceField.of(draw_map(shelves())),
    )
    follower.start(Path([(3.98, 4.6), (3.98, 1.5)]), None)
    follower.command(pose, Room(2.0), 0.1)
    nodes = [node.node_position for order in sent for node in order.nodes]
    return follower, [(round(node.x, 2), round(node.y, 2)) for node in nodes]


def test_an_agv_at_its_path_goes_along_it():
    follower, places = beside_a_shelf(Pose(3.97, 4.35, 0.0))
    assert places[:2] == [(3.97, 4.35), (3.98, 2.35)]
    assert not follower.is_off


def test_an_agv_beside_its_path_drives_onto_it_first_where_a_shelf_is_in_the_way():
    follower, places = beside_a_shelf(Pose(3.88, 4.35, 0.0))
    assert places[:3] == [(3.88, 4.35), (3.98, 4.35), (3.98, 2.35)]
    assert not follower.is_off


def test_an_agv_far_off_its_path_gets_no_order_but_asks_for_another_path():
    follower, places = beside_a_shelf(Pose(4.3, 4.35, 0.0))
    assert not places
    assert follower.is_off


def test_an_agv_that_a_new_goal_finds_far_off_the_path_to_it_gets_there():
    pair = Pair()
    pair.run(1.0)
    pair.drive(Pose(8.5, 2.0, 0.0))
    while pair.rig.speed < 0.6:
        pair.run(ROUND)
    pair.drive(Pose(2.0, 8.0, 0.0))  # it brakes, and then stands where no path was planned from
    pair.run(60.0)
    assert [result.state for result in pair.results] == [CommandState.SUCCEEDED]


def test_an_agv_off_its_path_keeps_its_goal_while_no_other_path_is_found(monkeypatch):
    pair = Pair()
    pair.run(1.0)
    pair.drive(Pose(8.5, 2.0, 0.0))
    while pair.rig.speed < 0.6:
        pair.run(ROUND)
    pair.drive(Pose(2.0, 8.0, 0.0))
    pair.run(ROUND)  # the path begins here, but it comes to a stop farther on
    plan = pair.planner.plan

    def fail(*_):
        raise PlanError("something that will go away is in the way", lasting=False)

    monkeypatch.setattr(pair.planner, "plan", fail)
    pair.run(6.0)
    assert not pair.results
    monkeypatch.setattr(pair.planner, "plan", plan)
    pair.run(60.0)
    assert [result.state for result in pair.results] == [CommandState.SUCCEEDED]


def test_an_agv_gets_the_next_part_of_its_base_before_it_has_to_brake():
    pair = Pair()
    pair.run(1.0)
    pair.drive(Pose(8.5, 1.6, 0.0))
    while pair.rig.pose.x < 4.0:
        pair.run(ROUND)
    speeds = []
    while pair.rig.pose.x < 7.0:
        pair.run(ROUND)
        speeds.append(pair.rig.speed)
    assert min(speeds) > 0.8 * max(speeds)


def test_an_agv_under_way_goes_on_to_its_goal_on_a_new_map():
    pair = Pair()
    pair.run(1.0)
    pair.drive(Pose(8.5, 2.0, 0.0))
    pair.run(3.0)
    before = len(pair.orders)
    new_shelf = Shape("new", shapely.geometry.box(6.0, 1.0, 6.6, 2.6))
    pair.use(draw_map(hall(*shelves().shapes, new_shelf)))
    pair.run(80.0)

    assert before
    assert pair.agent.follower.field is pair.planner.field
    assert [result.state for result in pair.results] == [CommandState.SUCCEEDED]
    assert all(pair.is_clear(order) for order in pair.orders[before + 1 :])
