# SPDX-License-Identifier: BSD-3-Clause
"""Cases in which robots once locked up; lasers, the real follower, and no ROS.

By the right of way alone (`local`) robots touch nobody, and get through wherever one of them can
be asked to move. With a traffic planner (`planned`) all get to their goals, and none stands.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_lab.bench.traffic.adversarial import LONGEST_STAND
from hive_lab.fleets.adversarial import drive, layout_of
from hive_lab.fleets.coordination import CoordinatorMaker
from hive_lab.fleets.sites import drawn_site, lab
from hive_lab.fleets.traffic import Traffic
from hive_navigation.control.goal_tracker import StuckDetector
from robot_description.models import load_model
from simenv.simulation import Simulation

GIVE_UP = 120.0  # a goal without progress is given up after this time [s]
CORNERS = 26  # runs around one place in a corner
PLACE = (0.85, 0.85)  # in the corner of the room

DOOR = 9.9  # x of a door of the lab, which has two between its halves [m]
STAND = 30.0  # nobody stands against its will for longer [s]

BESIDE_A_LANE = [(0.2, 2.35), (3.65, 5.8)]  # y of what leaves a lane of 1.3 m free [m]
SITES = {
    "room": drawn_site("room", (8.0, 8.0), [], room=0.6),
    "dead end": drawn_site(
        "dead end", (14.0, 6.0), [(6.0, low, 13.8, high) for low, high in BESIDE_A_LANE], room=0.55
    ),
    "lane": drawn_site(
        "lane", (22.0, 6.0), [(6.0, low, 16.0, high) for low, high in BESIDE_A_LANE], room=0.55
    ),
    "lab": lab(),
}


@pytest.fixture(params=["local", "planned"])
def planned(request):
    """Whether a traffic planner leads the robots."""
    return request.param == "planned"


@cache
def maker(site):
    """Return what makes traffic planners for LD-60s in a place."""
    return CoordinatorMaker(SITES[site], ("ld60",))


class Case:
    """Robots in a place, and for how long any of them stood still while it had a goal."""

    def __init__(self, site, starts, planned):
        self.simulation = Simulation(SITES[site].world, seed=1)
        coordinator = maker(site).coordinator() if planned else None
        self.traffic = Traffic(self.simulation, SITES[site].grid, coordinator)
        self.longest_stand = 0.0
        self._stuck = {name: StuckDetector() for name in starts}
        for name, pose in starts.items():
            self.traffic.add(name, load_model("ld60"), pose)

    def send(self, goals):
        """Give goals in this order."""
        for name, goal in goals.items():
            self.traffic.send(name, goal)
            self._stuck[name] = StuckDetector()
            self.traffic.step()

    def run(self, seconds, names):
        """Advance until the goals of some robots have ended; return whether all were reached."""
        end = self.simulation.time + seconds
        while set(names) - set(self.traffic.outcomes) and self.simulation.time < end:
            self.traffic.step()
            for name in set(names) - set(self.traffic.outcomes):
                self._stuck[name].update(self.simulation.time, self.simulation.poses[name])
                stands = self._stuck[name].duration(self.simulation.time)
                self.longest_stand = max(self.longest_stand, stands)
        return all(
            name in self.traffic.outcomes and self.traffic.outcomes[name].reached for name in names
        )


def around_the_corner(seed):
    """Return starts near the place in the corner, and goals: its own, and the others' starts."""
    random = np.random.default_rng(seed)
    spots = [PLACE]
    while len(spots) < 4:
        spot = tuple(random.uniform(0.85, 3.0, 2))
        if min(math.dist(spot, other) for other in spots) > 1.0:
            spots.append(spot)
    starts = {
        name: (*map(float, spot), float(random.uniform(-math.pi, math.pi)))
        for name, spot in zip("abcd", spots, strict=True)
    }
    turned = int(random.integers(1, 4))
    goals = {
        name: (*map(float, spots[(index + turned) % 4]), float(random.uniform(-math.pi, math.pi)))
        for index, name in enumerate("abcd")
    }
    order = [str(name) for name in random.permutation(list("abcd"))]
    return starts, {name: goals[name] for name in order}


@pytest.mark.parametrize("seed", range(CORNERS))
def test_four_robots_around_one_place_in_a_corner_do_not_lock_up(seed, planned):
    starts, goals = around_the_corner(seed)
    case = Case("room", starts, planned)
    case.send(goals)

    arrived = case.run(GIVE_UP, goals)

    assert case.simulation.collisions == 0
    if planned:  # by the right of way, a robot beside a path is not asked to move
        assert arrived
        assert case.longest_stand <= STAND


@pytest.mark.parametrize("first", ["a", "b"])
def test_two_robots_with_each_others_place_in_a_dead_end_change_places(first, planned):
    inner, outer = (13.0, 3.0, 0.0), (11.0, 3.0, 0.0)
    case = Case("dead end", {"a": inner, "b": outer}, planned)
    goals = {"a": outer, "b": inner}
    case.send(dict(sorted(goals.items(), key=lambda goal: goal[0] != first)))

    assert case.run(GIVE_UP, goals)
    assert case.simulation.collisions == 0
    assert case.longest_stand <= STAND


@pytest.mark.parametrize("first", ["a", "b"])
def test_two_robots_head_on_in_a_lane_one_robot_wide_both_get_through(first, planned):
    case = Case("lane", {"a": (8.0, 3.0, 0.0), "b": (14.0, 3.0, math.pi)}, planned)
    goals = {"a": (18.5, 3.0, 0.0), "b": (3.5, 3.0, math.pi)}
    case.send(dict(sorted(goals.items(), key=lambda goal: goal[0] != first)))

    assert case.run(GIVE_UP, goals)
    assert case.simulation.collisions == 0
    assert case.longest_stand <= STAND


def test_robots_take_another_way_when_one_has_died_in_a_door(planned):
    starts = {"dead": (7.0, 3.2, 0.0), "a": (5.0, 3.2, 0.0), "b": (12.5, 3.2, math.pi)}
    case = Case("lab", starts, planned)
    case.send({"dead": (13.5, 3.2, 0.0)})
    while case.simulation.poses["dead"].x < DOOR:
        case.traffic.step()
    case.traffic.held_up.add("dead")
    case.send({"a": (13.5, 2.6, 0.0), "b": (6.5, 3.2, math.pi)})

    assert case.run(GIVE_UP, "ab")
    assert case.simulation.collisions == 0
    assert case.longest_stand <= STAND


# Where robots have locked up with a traffic planner: `a` is where one starts, `A` where it goes.
LANES = {
    "four robots at a junction": """
        a   bA  .   cB  d
        #   #   .   #   #
        #   #   C   #   #
        #   #   D   #   #
    """,
    "three robots in a dead end with a bay": """
        .   .   .   .   .   aA  bC  cB
        #   #   #   #   #   .   #   #
    """,
    "an idle robot in a bay that two others need": """
        .   .   b   A   .   cB
        #   #   #   a   #   #
    """,
    "six robots that swap sides through a lane with a bay": """
        a   F   #   #   #   #   #   #   #   #   #   #   A   f
        b   E   .   .   .   .   .   .   .   .   .   .   B   e
        c   D   #   #   #   #   .   #   #   #   #   #   C   d
    """,
}


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("lane", LANES)
def test_robots_in_lanes_that_are_one_robot_wide_all_get_through(lane, seed):
    solved = drive(layout_of(LANES[lane]), seed)

    assert solved.reached == solved.asked
    assert solved.contacts == 0
    assert solved.longest_stand <= LONGEST_STAND
