# SPDX-License-Identifier: BSD-3-Clause
"""Robots that cannot go on are found from what they announce, named, and counted once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from hive_common.last_heard import FORGOTTEN_AFTER
from hive_navigation.traffic.deadlock import (
    CIRCLE_AFTER,
    NO_PROGRESS_AFTER,
    NOTHING_NEW_AFTER,
    OVERTAKEN_AFTER,
    SILENT,
    Kind,
    LockWatch,
    circles,
)
from hive_navigation.traffic.right_of_way import Announcement, no_right

GOAL = (50.0, 0.0)


def said(name, time, x=0.0, *, waits_for="", goal=GOAL, stationary=False):
    here = (x, 0.0)
    return Announcement(
        name,
        time,
        *here,
        0.4,
        no_right(name),
        (here,),
        0.0,
        stationary=stationary,
        goal=goal,
        waits_for=waits_for,
    )


class Watched:
    """A watch that hears robots and looks twice a second."""

    def __init__(self):
        self.watch = LockWatch()
        self.now = 0.0

    def run(self, seconds, *robots):
        """Pass time; `robots` are functions that return what one says at a time [s]."""
        for _ in range(round(seconds * 2)):
            self.now += 0.5
            for robot in robots:
                self.watch.hear(robot(self.now))
            self.watch.look(self.now)
        return [(lock.kind, lock.robots) for lock in self.watch.locks]

    @property
    def counts(self):
        return {kind: count for kind, count in self.watch.counts.items() if count}


@pytest.fixture
def watched():
    return Watched()


def stands(name, x=0.0, **more):
    return lambda now: said(name, now, x, **more)


def drives(name, speed=1.0, **more):
    return lambda now: said(name, now, speed * now, **more)


@pytest.mark.parametrize(
    ("pairs", "found"),
    [
        ([], []),
        (["ab"], []),
        (["ab", "bc"], []),
        (["ab", "ba"], ["ab"]),
        (["cb", "ba", "ac"], ["acb"]),
        (["da", "ab", "bc", "ca"], ["abc"]),
        (["ab", "ba", "dc", "cd", "ea"], ["ab", "cd"]),
        (["aa"], ["a"]),
    ],
)
def test_circles_are_found_without_those_that_wait_for_them(pairs, found):
    assert circles(dict(pairs)) == [tuple(each) for each in found]


def test_robots_that_stand_and_wait_for_each_other_are_a_circle(watched):
    robots = stands("a", 1.0, waits_for="b"), stands("b", 2.0, waits_for="a")

    assert watched.run(CIRCLE_AFTER, *robots) == []
    assert watched.run(1.0, *robots) == [(Kind.CIRCLE, ("a", "b"))]
    (lock,) = watched.watch.locks
    assert lock.at == ((1.0, 0.0), (2.0, 0.0))
    assert lock.since == 0.5


def test_a_circle_counts_once_while_it_lasts_and_again_when_it_comes_again(watched):
    circle = stands("a", waits_for="b", goal=None), stands("b", waits_for="a", goal=None)
    watched.run(20.0, *circle)
    assert watched.counts == {Kind.CIRCLE: 1}

    assert watched.run(1.0, stands("a", goal=None), stands("b", goal=None)) == []
    watched.run(20.0, *circle)
    assert watched.counts == {Kind.CIRCLE: 2}


def test_a_circle_in_which_one_still_drives_is_none(watched):
    robots = drives("a", waits_for="b"), stands("b", waits_for="a")

    assert watched.run(20.0, *robots) == []


def test_a_robot_that_waits_for_one_without_a_goal_is_blocked(watched):
    robots = stands("a", waits_for="b"), stands("b", goal=None)

    assert watched.run(NO_PROGRESS_AFTER, *robots) == []
    assert watched.run(2.0, *robots) == [(Kind.BLOCKED, ("a", "b"))]


@pytest.mark.parametrize(
    "other", [stands("b", stationary=True), stands("b"), lambda _: said("b", 0.5, goal=GOAL)]
)
def test_so_is_one_that_waits_for_one_that_must_stay_or_stands_or_is_silent(watched, other):
    kinds = watched.run(NO_PROGRESS_AFTER + 2.0, stands("a", waits_for="b"), other)

    assert (Kind.BLOCKED, ("a", "b")) in kinds


def test_a_robot_that_waits_for_a_stranger_is_blocked_by_it(watched):
    robots = [stands("a", 3.0, waits_for="stranger")]

    assert watched.run(NO_PROGRESS_AFTER + 2.0, *robots) == [(Kind.BLOCKED, ("a", "stranger"))]
    assert watched.watch.locks[0].at == ((3.0, 0.0), (3.0, 0.0))


def test_a_robot_before_which_others_go_again_and_again_is_overtaken(watched):
    robots = stands("a", waits_for="b"), stands("b", waits_for="c", goal=None), drives("c")

    assert watched.run(OVERTAKEN_AFTER - 1.0, *robots) == []
    assert watched.run(3.0, *robots) == [(Kind.OVERTAKEN, ("a", "b", "c"))]


def test_a_robot_that_waits_for_nobody_is_held(watched):
    assert watched.run(NO_PROGRESS_AFTER + 2.0, stands("a")) == [(Kind.HELD, ("a",))]


def test_a_robot_that_goes_to_and_fro_makes_no_progress(watched):
    def wavers(now):
        return said("a", now, 0.4 * (round(now) % 2))

    assert watched.run(NO_PROGRESS_AFTER + 2.0, wavers) == [(Kind.HELD, ("a",))]


def shuttles(now):
    """Say where a robot is that drives back and forth over three metres."""
    return said("a", now, abs(now % 6.0 - 3.0))


def test_a_robot_that_comes_nowhere_new_makes_no_progress_however_far_it_drives(watched):
    until_it_has_been_everywhere = 6.0

    assert watched.run(until_it_has_been_everywhere + NOTHING_NEW_AFTER, shuttles) == []
    assert watched.run(1.0, shuttles) == [(Kind.HELD, ("a",))]


def test_with_a_new_goal_all_places_are_new(watched):
    watched.run(NOTHING_NEW_AFTER, shuttles)

    def elsewhere(now):
        return replace(shuttles(now), goal=(9.0, 9.0))

    assert watched.run(NOTHING_NEW_AFTER, elsewhere) == []


def test_one_that_creeps_does(watched):
    assert watched.run(100.0, drives("a", 0.05)) == []


@pytest.mark.parametrize(
    "robot", [stands("a", goal=None), stands("a", stationary=True), drives("a")]
)
def test_who_has_nowhere_to_go_must_stay_or_drives_is_not_stuck(watched, robot):
    assert watched.run(100.0, robot) == []


def test_a_new_goal_begins_anew(watched):
    watched.run(NO_PROGRESS_AFTER - 2.0, stands("a"))

    assert watched.run(10.0, stands("a", goal=(9.0, 9.0))) == []


def test_who_waits_for_a_circle_is_told_of_no_more(watched):
    robots = (
        stands("a", waits_for="b"),
        stands("b", waits_for="a"),
        stands("c", waits_for="a"),
    )

    assert watched.run(NO_PROGRESS_AFTER + 5.0, *robots) == [(Kind.CIRCLE, ("a", "b"))]


def test_a_robot_counts_once_also_if_the_reason_changes(watched):
    watched.run(NO_PROGRESS_AFTER + 5.0, stands("a"))
    watched.run(5.0, stands("a", waits_for="b"), drives("b"))

    assert watched.counts == {Kind.HELD: 1}


def test_of_a_robot_that_is_silent_nothing_is_told(watched):
    watched.run(NO_PROGRESS_AFTER + 5.0, stands("a"))

    assert watched.run(SILENT + 1.0) == []


def test_after_the_clock_was_set_back_time_counts_anew(watched):
    watched.run(NO_PROGRESS_AFTER + 5.0, stands("a"))
    watched.now = 0.0

    assert watched.run(NO_PROGRESS_AFTER - 5.0, stands("a")) == []
    assert watched.run(10.0, stands("a")) == [(Kind.HELD, ("a",))]


def test_robots_that_have_left_are_forgotten_and_those_in_the_way_are_not(watched):
    wanted = stands("stuck", goal=(9.0, 0.0), waits_for="dead")
    watched.watch.hear(said("dead", 0.0, 1.0))
    watched.watch.hear(said("gone", 0.0, 5.0))
    watched.now = FORGOTTEN_AFTER - 10.0
    watched.run(20.0, wanted)

    assert set(watched.watch._robots) == {"stuck", "dead"}  # noqa: SLF001  (what it keeps)
    assert watched.watch.locks[0].robots == ("stuck", "dead")
    assert watched.watch.locks[0].at[1] == (1.0, 0.0)
    watched.run(20.0, drives("stuck"))
    assert set(watched.watch._robots) == {"stuck"}  # noqa: SLF001  (as above)
