# SPDX-License-Identifier: BSD-3-Clause
"""Robots that the coordinator plans in one search, and until when it does."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_lab.mapf.testing import robot
from hive_navigation.mapf import joint_planner
from hive_navigation.mapf.coupled import REACH
from hive_navigation.mapf.joint_planner import Timetable
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.mapf.route import NO_PLAN, PlanNumber, marks
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.traffic.committed import AT_GOAL, STANDS, STILL, Drive, Tracked
from hive_navigation.traffic.coordinator import REST, Coordinator, _timetable
from hive_navigation.traffic.retiming import Times
from hive_navigation.traffic.right_of_way import Announcement, no_right

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
    return planner(bay=True)


def planner(*, bay):
    blocked = np.ones((64, 200), dtype=bool)
    blocked[4:30, 4:-4] = False
    blocked[30:56, 90:116] = not bay
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


def test_two_robots_with_the_same_goal_get_there_one_after_the_other(lane):
    goal = (5.2, 0.85)
    for name in "ab":
        lane.hear(at(name, goal, time=0.1))
    lane.plan_together({"a", "b"})

    routes = {route.robot: route for route in lane.step(0.1)}

    assert lane._planner.coupled  # noqa: SLF001  (that the search has found it)
    assert lane.groups() == (frozenset("ab"),)
    assert courses(lane)["a"] == courses(lane)["b"] == pytest.approx(goal)
    assert routes["a"].complete
    assert routes["b"].complete


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


def test_a_search_that_found_nothing_is_made_again_after_some_seconds(monkeypatch):
    searched = []

    def counted(fleet, robots, points):
        searched.append(robots)
        return real(fleet, robots, points)

    real = joint_planner.coupled
    monkeypatch.setattr(joint_planner, "coupled", counted)
    coordinator = planner(bay=False)
    coordinator.plan_together({"a", "b"})

    def searches_at(time):
        for name in "ab":
            said = at(name, NEAR_GOALS[name], time=time)
            coordinator.hear(replace(said, plan=PlanNumber(1, 1)))
        before = len(searched)
        assert coordinator.step(time)
        return len(searched) - before

    assert searches_at(0.0) == 1
    assert [searches_at(share * REST) for share in (1 / 3, 2 / 3, 1)] == [0, 0, 1]
    assert coordinator.groups() == (frozenset("ab"),)

    coordinator.plan_together({"a"})
    assert searches_at(REST + 0.2) == 1


def test_a_robot_that_was_never_heard_is_in_no_group(lane):
    lane.plan_together({"a", "nobody"})

    assert lane.groups() == (frozenset("a"),)


def test_a_robot_that_has_stopped_just_before_the_end_of_its_route_stands(lane):
    said = at("a", NEAR_GOALS["a"], where=(7.0, 0.85))
    lane.step(0.0)
    (route,) = (r for r in lane.step(1.0) if r.robot == "a")
    claim = (STANDS + AT_GOAL) / 2
    short = replace(said, plan=route.plan, claim=claim, path=((7.0, 0.85), (7.0 - claim, 0.85)))
    tracked = Tracked(short)
    tracked.give(lane._robots["a"].drive)  # noqa: SLF001  (what it was given)

    tracked.hear(replace(short, time=STILL - 0.1))
    assert tracked.committed(STILL - 0.1).ahead > 0.0
    tracked.hear(replace(short, time=STILL))
    assert tracked.committed(STILL).ahead == 0.0

    moved = replace(short, time=STILL + 0.1, x=7.0 - 0.03)
    tracked.hear(moved)
    assert tracked.committed(STILL + 0.1).ahead > 0.0
    assert math.isfinite(tracked.committed(STILL + 0.1).ahead)


@pytest.mark.parametrize("passes", [False, True])
def test_a_robot_at_its_goal_goes_on_if_its_course_leads_away_and_back(passes):
    near, away, goal = (0.97, 0.0), (3.0, 0.0), (1.0, 0.05)
    points = ((0.0, 0.0), near, away, goal) if passes else ((0.0, 0.0), near, goal)
    said = replace(at("a", goal, where=near), plan=PlanNumber(1, 1), passed=960)
    tracked = Tracked(said)
    course = replace(drive(points, (1,) * len(points), complete=True), plan=said.plan)
    tracked.give(replace(course, marks=marks(0, points)))

    begun = tracked.committed(0.0)

    assert begun.rest.points[-1] == goal
    assert (begun.points[-1] != goal) == passes


@pytest.mark.parametrize("complete", [False, True])
def test_a_robot_waits_where_it_stands_and_not_a_little_farther_on(complete):
    rest = drive(((0.0, 0.0), (0.05, 0.0), (1.0, 0.0)), (-1, 3, 4), complete=complete)
    times = Times((0.0, 0.1, 9.0), (0.05, 7.0, math.inf))

    table = _timetable(rest, times, robot(10, 4), 10)

    assert table == Timetable((10, 4), (0.0, 9.0), (7.0, math.inf), complete=complete)


def test_a_course_of_which_nothing_is_left_but_the_goal_is_planned_anew():
    rest = drive(((0.0, 0.0), (0.05, 0.0)), (-1, 4), complete=True)

    assert _timetable(rest, Times((0.0, 0.1), (0.05, math.inf)), robot(10, 4), 10) is None


def drive(points, places, *, complete):
    """Return what is left of a course."""
    count = len(points)
    return Drive(
        plan=NO_PLAN,
        given=0.0,
        marks=tuple(round(1000 * x) for x, _ in points),
        points=points,
        places=places,
        arrives=(0.0,) * count,
        leaves=(0.0,) * count,
        complete=complete,
        goal=points[-1],
    )
