# SPDX-License-Identifier: BSD-3-Clause
"""Robots that the coordinator plans in one search, and until when it does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from robot_navigation.mapf.coupled import REACH
from robot_navigation.mapf.roadmap_builder import build_roadmap
from robot_navigation.planning.clearance import ClearanceField
from robot_navigation.traffic.committed import AT_GOAL, STANDS, STILL, Tracked
from robot_navigation.traffic.coordinator import Coordinator
from robot_navigation.traffic.right_of_way import Announcement, no_right

LANE = 1.3  # width of a lane for one robot [m]
NEAR_GOALS = {"a": (0.85, 0.85), "b": (9.0, 0.85)}
STARTS = {"a": (7.0, 0.85), "b": (3.0, 0.85), "c": (0.85, 0.85)}


def at(name, goal, time=0.0, where=None):
    x, y = where or STARTS[name]
    right = no_right(name)
    return Announcement(name, time, x, y, 0.43, right, ((x, y),), 0.0, stationary=False, goal=goal)


@pytest.fixture
def lane():
    """Return the planner of a lane with a bay in its middle."""
    blocked = np.ones((64, 200), dtype=bool)
    blocked[4:30, 4:-4] = False
    blocked[30:56, 90:116] = False
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
    coordinator = Coordinator(field, build_roadmap(field, [0.43]))
    for name in "abc":
        coordinator.hear(at(name, NEAR_GOALS.get(name)))
    return coordinator


def complete(routes):
    return {route.robot for route in routes if route.complete}


def courses(coordinator):
    """Return to where each robot is led, frame map."""
    return {name: robot.drive.points[-1] for name, robot in coordinator._robots.items()}  # noqa: SLF001


def test_a_group_takes_in_who_is_in_its_way_and_lasts_until_all_have_left_their_goals(lane):
    lane.plan_together({"a"})
    lane.step(0.0)

    assert lane.groups() == (frozenset("ab"),)
    assert courses(lane)["a"] == pytest.approx(NEAR_GOALS["a"])
    assert courses(lane)["b"] == pytest.approx(NEAR_GOALS["b"])

    lane.hear(at("a", (5.0, 0.85), time=1.0))
    lane.step(1.0)
    assert lane.groups() == (frozenset("b"),)

    lane.hear(at("b", None, time=2.0))
    lane.step(2.0)
    assert lane.groups() == ()


def test_groups_near_each_other_become_one_and_others_do_not(lane):
    far = (STARTS["b"][0] + REACH + 2.0, 0.85)
    lane.hear(at("d", (30.0, 0.85), where=far))

    lane.plan_together({"d"})
    lane.plan_together({"b"})
    assert lane.groups() == (frozenset("d"), frozenset("b"))

    lane.plan_together({"a"})
    assert lane.groups() == (frozenset({"a", "b", "d"}),)


def test_robots_are_planned_apart_again_with_all_that_they_were_together_with(lane):
    lane.plan_together({"a", "b"})

    lane.plan_apart({"c"})
    assert lane.groups() == (frozenset("ab"),)
    lane.plan_apart({"b"})
    assert lane.groups() == ()


def test_a_robot_that_was_never_heard_is_in_no_group(lane):
    lane.plan_together({"a", "nobody"})

    assert lane.groups() == (frozenset("a"),)


def test_a_robot_that_has_stopped_just_before_the_end_of_its_route_stands(lane):
    said = at("a", NEAR_GOALS["a"], where=(7.0, 0.85))
    lane.step(0.0)
    (route,) = (r for r in lane.step(1.0) if r.robot == "a")
    claim = (STANDS + AT_GOAL) / 2
    short = replace(said, plan=route.plan, claim=claim, path=((7.0, 0.85), (7.0 - claim, 0.85)))
    robot = Tracked(short)
    robot.give(lane._robots["a"].drive)  # noqa: SLF001  (what it was given)

    robot.hear(replace(short, time=STILL - 0.1))
    assert robot.committed(STILL - 0.1).ahead > 0.0
    robot.hear(replace(short, time=STILL))
    assert robot.committed(STILL).ahead == 0.0

    moved = replace(short, time=STILL + 0.1, x=7.0 - 0.03)
    robot.hear(moved)
    assert robot.committed(STILL + 0.1).ahead > 0.0
    assert math.isfinite(robot.committed(STILL + 0.1).ahead)
