# SPDX-License-Identifier: BSD-3-Clause
"""A lock is planned anew, then in one search, and after that left to the right of way."""

from __future__ import annotations

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.mapf.route import NO_PLAN
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.traffic.coordinator import Coordinator
from hive_navigation.traffic.deadlock import CIRCLE_AFTER, NO_PROGRESS_AFTER, Kind, Lock
from hive_navigation.traffic.lock_resolver import (
    COMES_BACK,
    LEFT_ALONE,
    RETRY,
    SEARCHED,
    LockResolver,
    ResolvingCoordinator,
    concerned,
)
from hive_navigation.traffic.right_of_way import Announcement, no_right


def lock(kind, *robots):
    return Lock(kind, robots, ((0.0, 0.0),) * len(robots), 0.0)


CIRCLE = lock(Kind.CIRCLE, "a", "b")
GIVEN_UP = RETRY + SEARCHED


def names(robots):
    return "".join(sorted(robots))


def run(resolver, *times, locks=(CIRCLE,), groups=()):
    """Return who is planned anew, in one search, and left alone, at each time."""
    remedies = [resolver.remedy(locks, time, groups) for time in times]
    return [
        (names(r.plan_anew), " ".join(map(names, r.plan_together)), names(r.left_alone))
        for r in remedies
    ]


def test_of_a_circle_all_are_planned_anew_else_the_first_robot_only():
    assert concerned(CIRCLE) == {"a", "b"}
    assert concerned(lock(Kind.OVERTAKEN, "a", "b", "c")) == {"a"}
    assert concerned(lock(Kind.HELD, "a")) == {"a"}


def test_a_lock_is_planned_anew_at_once_and_in_one_search_after_a_while():
    times = 0.0, 1.0, RETRY - 0.1, RETRY, RETRY + 1.0

    assert run(LockResolver(), *times) == [
        ("ab", "", ""),
        ("", "", ""),
        ("", "", ""),
        ("", "ab", ""),
        ("", "", ""),
    ]


def test_a_robot_is_planned_in_one_search_with_those_for_which_it_waits():
    waits = lock(Kind.OVERTAKEN, "a", "b", "c")

    assert run(LockResolver(), 0.0, RETRY, locks=[waits]) == [("a", "", ""), ("", "abc", "")]


def test_one_that_lasts_is_left_to_the_right_of_way_for_a_while_and_then_planned_anew():
    resolver = LockResolver()
    run(resolver, 0.0, RETRY)

    assert run(resolver, GIVEN_UP - 0.1) == [("", "", "")]
    assert run(resolver, GIVEN_UP, GIVEN_UP + LEFT_ALONE - 0.1) == [("", "", "ab")] * 2
    assert run(resolver, GIVEN_UP + LEFT_ALONE) == [("ab", "", "")]


def test_a_lock_that_comes_back_gets_the_next_remedy():
    resolver = LockResolver()
    run(resolver, 0.0)
    run(resolver, 1.0, locks=())

    other = lock(Kind.BLOCKED, "b", "c")
    assert run(resolver, COMES_BACK - 1.0, locks=[other]) == [("", "bc", "")]


def test_a_lock_that_comes_much_later_is_a_new_one():
    resolver = LockResolver()
    run(resolver, 0.0)
    run(resolver, 1.0, locks=())

    assert run(resolver, COMES_BACK + 1.0) == [("ab", "", "")]


def test_robots_that_wait_for_one_of_their_group_that_makes_progress_are_not_left_alone():
    resolver = LockResolver()
    run(resolver, 0.0, RETRY)
    group = [frozenset("abc")]

    assert run(resolver, GIVEN_UP, GIVEN_UP + 30.0, groups=group) == [("", "", "")] * 2
    assert run(resolver, GIVEN_UP + 31.0, groups=[frozenset("ab")]) == [("", "", "")]
    after = GIVEN_UP + 30.0 + SEARCHED
    assert run(resolver, after, groups=[frozenset("ab")]) == [("", "", "ab")]


def test_other_locks_are_resolved_meanwhile():
    resolver = LockResolver()
    run(resolver, 0.0, RETRY, GIVEN_UP)
    both = CIRCLE, lock(Kind.CIRCLE, "c", "d")

    assert run(resolver, GIVEN_UP + 1.0, locks=both) == [("cd", "", "ab")]


class Standing:
    """Two robots that stand on the floor, have goals, wait for each other, and take no routes."""

    def __init__(self, *, lock):
        blocked = np.zeros((200, 200), dtype=bool)
        blocked[:4] = blocked[-4:] = True
        blocked[:, :4] = blocked[:, -4:] = True
        field = ClearanceField.of(GridMap.of_blocked(blocked, 0.05))
        self.coordinator = ResolvingCoordinator(field, build_roadmap(field, [0.4]))
        self.waits = {"a": "b", "b": "a"} if lock else {"a": "", "b": ""}
        self.routes = {}
        self.now = 0.0

    def said(self, name, y):
        route = self.routes.get(name)
        return Announcement(
            name,
            self.now,
            2.0,
            y,
            0.4,
            no_right(name),
            ((2.0, y),),
            0.0,
            stationary=False,
            goal=(8.0, y),
            waits_for=self.waits[name],
            plan=NO_PLAN if route is None else route.plan,
            passed=0 if route is None else route.first,
        )

    def run(self, seconds):
        """Return at which times there was a plan, and who had places in it."""
        plans = []
        for _ in range(round(seconds * 4)):
            self.now += 0.25
            for name, y in (("a", 3.0), ("b", 7.0)):
                self.coordinator.hear(self.said(name, y))
            routes = self.coordinator.step(self.now)
            if routes:
                assert {route.robot for route in routes} == {"a", "b"}
                plans.append((self.now, {route.robot for route in routes if route.places}))
            self.routes |= {route.robot: route for route in routes}
        return plans


def test_the_robots_of_a_lock_that_no_plan_resolves_get_routes_without_places_for_a_while():
    plans = Standing(lock=True).run(CIRCLE_AFTER + GIVEN_UP + LEFT_ALONE + 5.0)
    alone = [now for now, robots in plans if not robots]

    assert alone[0] == pytest.approx(CIRCLE_AFTER + GIVEN_UP, abs=1.5)
    assert alone[-1] - alone[0] == pytest.approx(LEFT_ALONE, abs=1.5)
    assert [robots for now, robots in plans if not alone[0] <= now <= alone[-1]] == (
        [{"a", "b"}] * (len(plans) - len(alone))
    )


@pytest.mark.parametrize(("lock", "forgotten"), [(True, {"a", "b"}), (False, set())])
def test_the_next_plan_of_locked_robots_forgets_their_courses(monkeypatch, lock, forgotten):
    robots, found = Standing(lock=lock), set()
    robots.run(CIRCLE_AFTER - 0.5)
    plan = Coordinator.step

    def noted(coordinator, now):
        known = coordinator._robots.items()  # noqa: SLF001  (what a plan begins with)
        found.update(name for name, robot in known if robot.drive is None)
        return plan(coordinator, now)

    monkeypatch.setattr(Coordinator, "step", noted)
    robots.run(3.0)

    assert found == forgotten


def test_robots_that_are_not_locked_always_get_routes():
    plans = Standing(lock=False).run(NO_PROGRESS_AFTER - 1.0)

    assert all(robots == {"a", "b"} for _, robots in plans)
