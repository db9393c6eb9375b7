# SPDX-License-Identifier: BSD-3-Clause
"""Cases in which robots once locked up; lasers, the real follower, and no ROS."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("ompl")

from hive_lab.fleets.sites import drawn_site, lab
from hive_lab.fleets.traffic import Traffic
from robot_description.models import load_model
from simenv.simulation import Simulation

GIVE_UP = 120.0  # a goal without progress is given up after this time [s]
CORNERS = 26  # runs around one place in a corner
PLACE = (0.85, 0.85)  # in the corner of the room

ROOM = drawn_site("room", (8.0, 8.0), [], room=0.6)
# A lane of 1.3 m, closed on the right; the room on the left is wide.
DEAD_END = drawn_site(
    "dead end", (14.0, 6.0), [(6.0, 0.2, 13.8, 2.35), (6.0, 3.65, 13.8, 5.8)], room=0.55
)
# Two rooms and a lane of 1.3 m between them.
LANE = drawn_site(
    "lane", (22.0, 6.0), [(6.0, 0.2, 16.0, 2.35), (6.0, 3.65, 16.0, 5.8)], room=0.55
)


class Case:
    """Robots in a place, and how long each stood still while it had a goal."""

    def __init__(self, site, starts, model="ld60"):
        self.simulation = Simulation(site.world, seed=1)
        self.traffic = Traffic(self.simulation, site.grid)
        for name, pose in starts.items():
            self.traffic.add(name, load_model(model), pose)

    def send(self, goals):
        """Give goals in this order."""
        for name, goal in goals.items():
            self.traffic.send(name, goal)
            self.traffic.step()

    def all_arrive(self, seconds):
        """Return whether all get to their goals in time and touch nothing."""
        return (
            self.traffic.run(seconds)
            and all(outcome.reached for outcome in self.traffic.outcomes.values())
            and self.simulation.collisions == 0
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
def test_four_robots_around_one_place_in_a_corner_all_get_to_their_goals(seed):
    starts, goals = around_the_corner(seed)
    case = Case(ROOM, starts)
    case.send(goals)

    assert case.all_arrive(GIVE_UP)


@pytest.mark.parametrize("first", ["a", "b"])
def test_two_robots_with_each_others_place_in_a_dead_end_change_places(first):
    inner, outer = (13.0, 3.0, 0.0), (11.0, 3.0, 0.0)
    case = Case(DEAD_END, {"a": inner, "b": outer})
    goals = {"a": outer, "b": inner}
    case.send(dict(sorted(goals.items(), key=lambda goal: goal[0] != first)))

    assert case.all_arrive(GIVE_UP)


@pytest.mark.parametrize("first", ["a", "b"])
def test_two_robots_head_on_in_a_lane_one_robot_wide_both_get_through(first):
    case = Case(LANE, {"a": (8.0, 3.0, 0.0), "b": (14.0, 3.0, math.pi)})
    goals = {"a": (18.5, 3.0, 0.0), "b": (3.5, 3.0, math.pi)}
    case.send(dict(sorted(goals.items(), key=lambda goal: goal[0] != first)))

    assert case.all_arrive(GIVE_UP)


def test_robots_take_another_way_when_one_has_died_in_a_door():
    starts = {"dead": (7.0, 3.2, 0.0), "a": (5.0, 3.2, 0.0), "b": (12.5, 3.2, math.pi)}
    case = Case(lab(), starts)
    case.send({"dead": (13.5, 3.2, 0.0)})
    while case.simulation.poses["dead"].x < 9.9:
        case.traffic.step()
    case.traffic.held_up.add("dead")
    case.send({"a": (13.5, 2.6, 0.0), "b": (6.5, 3.2, math.pi)})
    end = case.simulation.time + GIVE_UP
    while {"a", "b"} - set(case.traffic.outcomes) and case.simulation.time < end:
        case.traffic.step()

    assert [case.traffic.outcomes[name].reached for name in ("a", "b")] == [True, True]
    assert case.simulation.collisions == 0
