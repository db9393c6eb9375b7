# SPDX-License-Identifier: BSD-3-Clause
"""A robot takes a route that holds what it cannot avoid, and waits for whom the route says."""

import math
from dataclasses import replace

import pytest

from hive_common.pose import Pose
from hive_navigation.control.route_keeper import SILENCE, RouteKeeper
from hive_navigation.mapf.route import NO_PLAN, PlanNumber, Route, Wait
from hive_navigation.traffic.neighbourhood import Neighbourhood
from hive_navigation.traffic.right_of_way import Announcement, no_right

PLAN = PlanNumber(3, 7)
GOAL = Pose(4.0, 0.0, 0.0)
HERE = Pose(0.0, 0.0, 0.0)


def route(*waits, plan=PLAN, first=10_000, goal=(4.0, 0.0), places=None, robot="me"):
    places = places or tuple((float(x), 0.0) for x in range(5))
    return Route(robot, plan, goal, first, places, waits, complete=True)


def heard(passed, plan=PLAN, path=((9.0, 9.0),), claim=0.0):
    neighbourhood = Neighbourhood()
    neighbourhood.hear(
        Announcement(
            "other",
            0.0,
            9.0,
            9.0,
            0.4,
            no_right("other"),
            path,
            claim,
            stationary=False,
            plan=plan,
            passed=passed,
        )
    )
    return neighbourhood


@pytest.fixture
def keeper():
    return RouteKeeper("me")


def test_it_takes_its_own_route_from_where_it_is(keeper):
    keeper.hear([route(robot="other"), route()], now=0.0)

    path = keeper.offer(GOAL, Pose(1.4, 0.05, 0.0), [])

    assert path.length == pytest.approx(2.6)
    assert (keeper.plan, keeper.passed) == (PLAN, 11_400)


def test_it_refuses_a_route_to_another_goal(keeper):
    keeper.hear([route()], now=0.0)

    assert keeper.offer(Pose(4.0, 1.0, 0.0), HERE, []) is None
    assert keeper.plan == NO_PLAN


def test_a_robot_without_a_goal_takes_a_route_aside_only(keeper):
    keeper.hear([route()], now=0.0)
    assert keeper.offer(None, HERE, []) is None

    keeper.hear([route(goal=None, plan=PlanNumber(3, 8))], now=0.0)
    assert keeper.offer(None, HERE, []) is not None


def test_it_refuses_a_route_that_leaves_out_what_it_cannot_avoid(keeper):
    keeper.hear([route()], now=0.0)

    assert keeper.offer(GOAL, HERE, [(0.0, 0.0), (0.0, 1.0)]) is None


def test_it_refuses_a_route_that_begins_elsewhere(keeper):
    keeper.hear([route()], now=0.0)

    assert keeper.offer(GOAL, Pose(0.0, 2.0, 0.0), []) is None


def test_on_a_path_that_comes_by_twice_it_is_where_it_has_driven_to(keeper):
    there_and_back = ((0.0, 0.0), (2.0, 0.0), (0.0, 0.0), (0.0, 3.0))
    keeper.hear([route(places=there_and_back)], now=0.0)
    keeper.offer(GOAL, HERE, [])
    keeper.advance(0.5)
    keeper.hear([route(places=there_and_back, plan=PlanNumber(3, 8))], now=1.0)

    path = keeper.offer(GOAL, Pose(0.5, 0.0, 0.0), [])

    assert path.length == pytest.approx(6.5)
    assert keeper.passed == 10_500


def test_a_robot_that_goes_on_along_its_path_counts_on(keeper):
    keeper.hear([route()], now=0.0)
    keeper.offer(GOAL, HERE, [])
    keeper.advance(1.0)
    keeper.hear([route(Wait(13_000, "other", 5_000), plan=PlanNumber(3, 8))], now=1.0)
    keeper.offer(GOAL, Pose(1.0, 0.0, 0.0), [])
    keeper.go_on(1.0)
    keeper.advance(1.5)

    assert keeper.passed == 11_500
    assert keeper.hold(1.5, heard(passed=0)).room == pytest.approx(1.5)


def test_an_older_plan_does_not_replace_a_newer_one(keeper):
    keeper.hear([route()], now=0.0)
    keeper.offer(GOAL, HERE, [])
    keeper.hear([route(plan=PlanNumber(2, 99))], now=1.0)

    assert keeper.offer(GOAL, HERE, []) is None
    assert keeper.plan == PLAN


def test_plans_that_are_counted_from_the_beginning_again_are_taken_after_a_silence(keeper):
    keeper.hear([route(plan=PlanNumber(4003, 70))], now=0.0)
    keeper.offer(GOAL, HERE, [])
    again = [route(plan=PlanNumber(1001, number)) for number in (1, 2, 3)]

    keeper.hear([again[0]], now=SILENCE - 0.1)
    assert keeper.offer(GOAL, HERE, []) is None
    for number, later in ((1, 0.0), (2, 1.0)):
        keeper.hear([again[number]], now=SILENCE + later)
        assert keeper.offer(GOAL, HERE, []) is not None
        assert keeper.plan == again[number].plan


def test_a_route_without_places_leaves_the_robot_alone_at_once(keeper):
    keeper.hear([route()], now=0.0)
    alone = replace(route(plan=PlanNumber(3, 8)), places=())
    keeper.hear([alone], now=1.0)

    assert not keeper.is_guided(1.0)
    assert keeper.offer(GOAL, HERE, []) is None
    keeper.hear([route(plan=PlanNumber(3, 9))], now=2.0)
    assert keeper.is_guided(2.0)


def test_a_plan_that_is_heard_once_more_guides_nobody(keeper):
    keeper.hear([route()], now=0.0)
    keeper.hear([route()], now=SILENCE)

    assert not keeper.is_guided(SILENCE)


def test_it_counts_what_it_has_driven(keeper):
    keeper.hear([route()], now=0.0)
    keeper.offer(GOAL, HERE, [])

    counts = []
    for progress in (0.5, 0.95, 1.5, 2.0, 4.0):
        keeper.advance(progress)
        counts.append(keeper.passed)

    assert counts == [10_500, 10_950, 11_500, 12_000, 14_000]


def test_it_stops_at_the_place_where_another_one_goes_first(keeper):
    keeper.hear([route(Wait(12_000, "other", 5_000))], now=0.0)
    keeper.offer(GOAL, HERE, [])
    keeper.advance(0.5)

    hold = keeper.hold(0.5, heard(passed=4_000))

    assert (hold.room, hold.robot) == (pytest.approx(1.5), "other")


def test_it_goes_on_when_the_other_one_has_passed(keeper):
    keeper.hear([route(Wait(12_000, "other", 5_000))], now=0.0)
    keeper.offer(GOAL, HERE, [])

    assert math.isinf(keeper.hold(0.0, heard(passed=5_000)).room)


def test_it_follows_one_that_claims_its_way_past_as_far_as_the_claim_lets_it(keeper):
    keeper.hear([route(Wait(12_000, "other", 2_000))], now=0.0)
    keeper.offer(GOAL, HERE, [])
    ahead = ((9.0, 9.0), (10.2, 9.0))

    assert keeper.hold(0.0, heard(1_000, path=ahead, claim=0.5)).room == pytest.approx(2.0)
    assert keeper.hold(0.0, heard(1_000, path=ahead, claim=1.0)).room == math.inf
    # It is to stop at the end of its path, which its claim reaches beyond.
    assert keeper.hold(0.0, heard(500, path=ahead, claim=3.0)).room == pytest.approx(2.0)


def test_it_waits_for_one_that_follows_a_plan_of_another_epoch_or_is_not_heard(keeper):
    keeper.hear([route(Wait(12_000, "other", 5_000))], now=0.0)
    keeper.offer(GOAL, HERE, [])

    assert keeper.hold(0.0, heard(passed=9_000, plan=PlanNumber(2, 1))).room == pytest.approx(2.0)
    assert keeper.hold(0.0, Neighbourhood()).room == pytest.approx(2.0)


def test_what_it_has_passed_holds_it_no_more(keeper):
    keeper.hear([route(Wait(10_000, "other", 5_000))], now=0.0)
    keeper.offer(GOAL, HERE, [])
    keeper.advance(1.0)

    assert math.isinf(keeper.hold(1.0, heard(passed=0)).room)


def test_a_planner_that_is_silent_guides_no_more(keeper):
    keeper.hear([route()], now=0.0)

    assert keeper.is_guided(SILENCE - 0.1)
    assert not keeper.is_guided(SILENCE)


def test_a_robot_that_plans_leave_out_is_guided_no_more(keeper):
    keeper.hear([route()], now=0.0)
    keeper.hear([route(robot="other", plan=PlanNumber(3, 8))], now=SILENCE)

    assert not keeper.is_guided(SILENCE)
    keeper.hear([route(plan=PlanNumber(3, 7))], now=SILENCE)
    assert not keeper.is_guided(SILENCE)
    keeper.hear([route(plan=PlanNumber(3, 9))], now=SILENCE)
    assert keeper.is_guided(SILENCE)
