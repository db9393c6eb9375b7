# SPDX-License-Identifier: BSD-3-Clause
"""Goals that come faster than a robot settles: it drives toward the latest, as in follow-me."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_common.grid_map import GridMap
from hive_common.map_file import load_map
from hive_common.pose import STOP, Pose
from hive_lab.fleets.traffic import STEP, Traffic
from hive_navigation.control.driver import Driver
from hive_navigation.control.follower import Room
from hive_navigation.control.navigator import ROUTE_WITHIN
from hive_navigation.control.obstacle_check import VisibleObstacles
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.planning.path import Path
from hive_navigation.traffic.lock_resolver import ResolvingCoordinator
from hive_navigation.traffic.right_of_way import Limits
from robot_description.models import load_model
from simenv.simulation import Simulation
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from hive_common.pose import Velocity

SECONDS = 8.0
START, END = (2.6, 3.2, 0.0), (13.5, 3.2, 0.0)
AHEAD = 2.5  # of the robot, where the one is whom it follows [m]
RATES = pytest.mark.parametrize("rate", [2.0, 5.0, 10.0])


class Lab:
    """The lab with one robot, alone or led by a traffic planner."""

    def __init__(self, model: str, *, led: bool = False, yaw: float = 0.0) -> None:
        self.simulation = Simulation(load_world("lab"), seed=1)
        self.grid = load_map("lab")
        radius = load_model(model).base.circumscribed_radius
        field = ClearanceField.of(self.grid)
        coordinator = None
        if led:
            coordinator = ResolvingCoordinator(field, build_roadmap(field, [radius]))
        self.traffic = Traffic(self.simulation, self.grid, coordinator)
        self.traffic.add("robot1", load_model(model), (*START[:2], yaw))

    def way(self) -> float:
        """Return how far from its start the robot is [m]."""
        return math.dist(START[:2], self.simulation.poses["robot1"][:2])

    def follow(self, rate: float, seconds: float) -> None:
        """Send goals at a rate [Hz] that lie ahead of the robot and sway a little."""
        begin = self.simulation.time
        for step in range(round(seconds / STEP)):
            if step % round(1 / (rate * STEP)) == 0:
                aside = 0.2 * math.sin(self.simulation.time - begin)
                x = self.simulation.poses["robot1"].x + AHEAD
                self.traffic.send("robot1", (x, END[1] + aside, 0.0))
            self.traffic.step()


@lru_cache
def way_of_one_goal(model: str) -> float:
    lab = Lab(model)
    lab.traffic.send("robot1", END)
    for _ in range(round(SECONDS / STEP)):
        lab.traffic.step()
    return lab.way()


@RATES
@pytest.mark.parametrize("model", ["mir100", "youbot"])
def test_a_robot_whose_goal_goes_on_ahead_follows_it(rate: float, model: str) -> None:
    lab = Lab(model)

    lab.follow(rate, SECONDS)

    assert way_of_one_goal(model) > 5.0
    assert lab.way() > 0.8 * way_of_one_goal(model)
    assert lab.simulation.collisions == 0


@RATES
def test_a_robot_that_a_traffic_planner_leads_waits_for_one_route_and_then_follows(
    rate: float,
) -> None:
    lab = Lab("mir100", led=True)

    lab.follow(rate, ROUTE_WITHIN + SECONDS)

    assert lab.way() > 0.7 * way_of_one_goal("mir100")
    assert lab.simulation.collisions == 0


@RATES
@pytest.mark.parametrize("led", [False, True])
def test_a_robot_whose_goal_is_sent_again_and_again_reaches_it(rate: float, led: bool) -> None:
    lab = Lab("mir100", led=led, yaw=math.pi)  # so that it has to turn first

    for step in range(round(14.0 / STEP)):
        if step % round(1 / (rate * STEP)) == 0:
            lab.traffic.send("robot1", (8.0, 3.2, 0.0))
        lab.traffic.step()

    assert math.dist((8.0, 3.2), lab.simulation.poses["robot1"][:2]) < 0.1
    assert lab.simulation.collisions == 0


@RATES
@pytest.mark.parametrize("led", [False, True])
def test_a_robot_that_has_to_turn_to_the_one_it_follows_does_so_and_follows(
    rate: float, led: bool
) -> None:
    lab = Lab("mir100", led=led, yaw=math.pi)

    lab.follow(rate, ROUTE_WITHIN + SECONDS)

    assert lab.way() > 4.0
    assert lab.simulation.collisions == 0


def test_robots_whose_goals_jump_about_do_not_touch_each_other() -> None:
    lab = Lab("mir100")
    for name, place in (("robot2", (2.6, 4.6)), ("robot3", (5.0, 3.2)), ("robot4", (7.4, 3.2))):
        lab.traffic.add(name, load_model("ld60"), (*place, 0.0))
    random = np.random.default_rng(1)
    places = [(3.0, 3.2), (8.0, 3.2), (12.0, 3.2), (5.0, 2.6), (6.0, 4.0), (12.0, 9.0)]
    driven = 0.0
    while lab.simulation.time < 60.0:
        before = lab.simulation.poses["robot1"]
        for name in lab.traffic.navigators:
            if random.random() < 0.1:
                x, y = places[random.integers(len(places))] + random.uniform(-0.3, 0.3, 2)
                lab.traffic.send(name, (float(x), float(y), 0.0))
        for _ in range(4):
            lab.traffic.step()
        driven += math.dist(before[:2], lab.simulation.poses["robot1"][:2])

    assert driven > 3.0
    assert lab.simulation.collisions == 0


class Rooms:
    """A follower that stands, and notes how far it may go."""

    progress = committed = 0.0
    arrived = False
    room = Room(0.0)

    def start(self, path: Path, goal_yaw: float | None) -> None: ...

    def command(self, _pose: Pose, room: Room, _dt: float) -> Velocity:
        self.room = room
        return STOP

    def limits(self, _room: float) -> Limits:
        return Limits(1.0, 1.0, 1.0)


def room_after(path: Path, *, after: float, former: Path | None) -> float:
    """Return how far a robot may go on a path that it took up so long ago [s]."""
    open_field = GridMap.of_blocked(np.zeros((400, 400), dtype=bool), 0.05)
    follower = Rooms()
    driver = Driver(
        load_model("mir100"), cast("Any", follower), ClearanceField.of(open_field), settle=0.3
    )
    if former is not None:
        driver.start(former, None, settle_from=0.0)
        driver.let_go()
    driver.start(path, None, settle_from=10.0)
    nothing = VisibleObstacles(np.empty((0, 2)), np.empty((0, 2)))
    driver.drive(10.0 + after, Pose(5.0, 5.0, 0.0), nothing, math.inf)
    return follower.room.ahead


def test_until_the_others_know_a_new_path_a_robot_drives_what_it_shares_with_the_one_before() -> (
    None
):
    before = Path([(5.0, 5.0), (5.6, 5.0)])
    goes_on, turns = Path([(5.0, 5.0), (9.0, 5.05)]), Path([(5.0, 5.0), (5.0, 9.0)])
    far = room_after(goes_on, after=0.31, former=None)

    assert room_after(goes_on, after=0.29, former=None) == 0.0
    assert room_after(goes_on, after=0.0, former=before) == pytest.approx(0.7, abs=0.1)
    assert room_after(turns, after=0.0, former=before) == pytest.approx(0.15, abs=0.06)
    assert far > 1.0
    assert room_after(goes_on, after=0.31, former=before) == far
    assert room_after(turns, after=0.31, former=before) == far
