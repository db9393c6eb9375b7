# SPDX-License-Identifier: BSD-3-Clause
"""Robots that drive along given routes: real planner, follower and laser in the lab, no ROS."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

pytest.importorskip("ompl")

from hive_common.map_file import load_map
from hive_lab.fleets.traffic import Traffic
from hive_navigation.control.route_keeper import SILENCE
from hive_navigation.mapf.route import NO_PLAN, PlanNumber, Route, Wait
from robot_description.models import load_model
from simenv.simulation import Simulation
from simenv.world.world_file import load_world

NORTH, SOUTH = (2.6, 4.0), (2.6, 2.0)
DETOUR = (NORTH, (4.0, 4.0), (4.0, 2.0), (5.0, 2.0))
"""A route that is much longer than the straight line from its start to its end."""
DETOURED = 1400  # mark of its second place


class Script:
    """A coordinator that repeats the plan of the test every second, under a new number.

    Attributes:
        plan: The routes; a route's own plan number counts no more.
        said: What each robot announced last.
        silent: Whether it says nothing any more.
    """

    def __init__(self, *plan):
        self.plan = plan
        self.said = {}
        self.silent = False
        self._number = 0
        self._next = 0.0

    def hear(self, said):
        self.said[said.name] = said

    def step(self, now):
        if self.silent or now < self._next:
            return ()
        self._next = now + 1.0
        self._number += 1
        return tuple(replace(each, plan=PlanNumber(1, self._number)) for each in self.plan)


def route(robot, *places, waits=(), goal=None, complete=True, first=0):
    return Route(robot, NO_PLAN, goal or places[-1], first, places, tuple(waits), complete)


def lab(script):
    simulation = Simulation(load_world("lab"), seed=1)
    traffic = Traffic(simulation, load_map("lab"), script)
    traffic.add("a", load_model("ld60"), (*NORTH, 0.0))
    traffic.add("b", load_model("ld60"), (*SOUTH, 0.0))
    return simulation, traffic


def drive(simulation, traffic, seconds, name="a"):
    """Run for a time [s]; return where a robot has been."""
    track = []
    for _ in range(round(seconds / 0.025)):
        traffic.step()
        track.append(simulation.poses[name][:2])
    return track


def test_a_robot_drives_along_its_route_rather_than_the_shortest_path():
    script = Script(route("a", *DETOUR))
    simulation, traffic = lab(script)
    traffic.send("a", (*DETOUR[-1], 0.0))

    track = drive(simulation, traffic, 20.0)

    assert traffic.outcomes["a"].reached
    assert min(math.dist(place, DETOUR[1]) for place in track) < 0.15
    driven = sum(math.dist(*leg) for leg in itertools.pairwise(DETOUR))
    assert script.said["a"].passed == pytest.approx(1000 * driven, abs=50)


def test_it_waits_at_a_place_until_the_other_robot_has_passed():
    script = Script(
        route("a", *DETOUR, waits=[Wait(DETOURED, "b", 1000)]),
        route("b", SOUTH, (1.6, 2.0)),
    )
    simulation, traffic = lab(script)
    traffic.send("a", (*DETOUR[-1], 0.0))

    drive(simulation, traffic, 10.0)
    assert math.dist(simulation.poses["a"][:2], DETOUR[1]) < 0.2
    assert script.said["a"].waits_for == "b"

    traffic.send("b", (1.6, 2.0, 0.0))
    drive(simulation, traffic, 20.0)
    assert traffic.outcomes["a"].reached


def test_a_robot_whose_goal_is_dropped_waits_for_nobody():
    script = Script(route("a", *DETOUR, waits=[Wait(DETOURED, "b", 1000)]))
    simulation, traffic = lab(script)
    traffic.send("a", (*DETOUR[-1], 0.0))

    drive(simulation, traffic, 10.0)
    assert script.said["a"].waits_for == "b"

    traffic.navigators["a"].cancel()
    drive(simulation, traffic, 1.0)
    assert script.said["a"].waits_for == ""


def test_a_route_that_is_not_complete_is_followed_to_its_end_and_then_on():
    goal = DETOUR[-1]
    script = Script(route("a", *DETOUR[:2], goal=goal, complete=False))
    simulation, traffic = lab(script)
    traffic.send("a", (*goal, 0.0))

    drive(simulation, traffic, 8.0)
    assert math.dist(simulation.poses["a"][:2], DETOUR[1]) < 0.2
    assert "a" not in traffic.outcomes

    script.plan = (route("a", *DETOUR[1:], first=DETOURED),)
    drive(simulation, traffic, 10.0)
    assert traffic.outcomes["a"].reached


def test_a_robot_changes_to_a_new_route_without_stopping():
    script = Script(route("a", NORTH, (5.0, 4.0)))
    simulation, traffic = lab(script)
    traffic.send("a", (5.0, 4.0, 0.0))
    drive(simulation, traffic, 1.8)

    script.plan = (route("a", NORTH, (3.9, 4.0), (5.0, 4.0)),)
    track = drive(simulation, traffic, 0.8)

    assert script.said["a"].plan.number == 3
    assert min(math.dist(*pair) / 0.025 for pair in itertools.pairwise(track)) > 0.4


def test_without_a_plan_for_some_time_it_goes_on_by_itself():
    script = Script(route("a", *DETOUR, waits=[Wait(DETOURED, "nobody", 1000)]))
    simulation, traffic = lab(script)
    traffic.send("a", (*DETOUR[-1], 0.0))
    drive(simulation, traffic, 3.0)
    assert script.said["a"].plan != NO_PLAN

    script.silent = True
    drive(simulation, traffic, SILENCE + 10.0)

    assert traffic.outcomes["a"].reached
    assert script.said["a"].plan == NO_PLAN


def test_a_robot_without_a_goal_is_led_aside():
    aside = Route("a", NO_PLAN, None, 0, (NORTH, (4.0, 4.0)), (), complete=True)
    simulation, traffic = lab(Script(aside))

    drive(simulation, traffic, 5.0)

    assert math.dist(simulation.poses["a"][:2], (4.0, 4.0)) < 0.1
