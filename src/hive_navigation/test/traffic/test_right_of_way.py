# SPDX-License-Identifier: BSD-3-Clause
"""The right of way: who goes first, where the others wait, and who blocks a path."""

from __future__ import annotations

import math
from itertools import permutations

import pytest

from hive_navigation.traffic.right_of_way import (
    GAP,
    HOLD,
    MIN_GAP,
    Announcement,
    Meeting,
    Right,
    meetings,
    no_right,
)

Point = tuple[float, float]


def robot(
    name: str, *path: Point, since: float = math.inf, claim: float = 0.0, radius: float = 0.4
) -> Announcement:
    right = no_right(name) if math.isinf(since) else Right(since, name, 0, name)
    x, y = path[0]
    return Announcement(name, 0.0, x, y, radius, right, path, claim, stationary=False)


def meet(me: Announcement, other: Announcement) -> Meeting:
    return meetings(me, [me, other])[0]


def test_the_older_goal_goes_first_then_the_name_and_no_goal_goes_last() -> None:
    older, younger = Right(1.0, "b", 0, "b"), Right(2.0, "a", 0, "a")

    assert older < younger < no_right("a")
    assert Right(1.0, "a", 0, "a") < older


def test_moving_aside_ranks_just_behind_a_right_and_being_let_out_just_before_it() -> None:
    first, second = Right(1.0, "a", 0, "a"), Right(2.0, "b", 0, "b")

    assert first < first.behind("c") < second
    assert second.before("c") < second
    assert first < second.before("c")


def test_rights_of_different_robots_are_never_equal() -> None:
    first = Right(1.0, "a", 0, "a")
    rights = [first, first.behind("b"), first.behind("c"), first.before("d"), no_right("e")]

    assert all((one < other) != (other < one) for one, other in permutations(rights, 2))


def test_a_robot_waits_before_the_path_of_one_that_goes_first() -> None:
    me = robot("me", (0, 0), (8, 0), since=2.0)
    first = robot("first", (5, -6), (5, 6), since=1.0)

    assert meet(me, first).room == pytest.approx(5 - 0.8 - GAP - HOLD, abs=0.15)
    assert not meet(me, first).on_its_path


def test_the_one_that_goes_first_waits_for_claims_only() -> None:
    first = robot("first", (0, 0), (8, 0), since=1.0)
    crossing = robot("me", (5, -6), (5, 6), since=2.0, claim=0.5)
    standing = robot("me", (5, 0), since=2.0)

    assert math.isinf(meet(first, crossing).room)
    assert meet(first, standing).room == pytest.approx(5 - 0.8 - GAP, abs=0.2)


def test_a_claim_is_respected_whoever_goes_first() -> None:
    first = robot("first", (0, 0), (8, 0), since=1.0)
    crossing = robot("me", (5, -2), (5, 6), since=2.0, claim=2.0)

    assert meet(first, crossing).room == pytest.approx(5 - 0.8 - GAP, abs=0.2)


def test_head_on_the_robot_with_the_younger_goal_blocks_the_path() -> None:
    me = robot("me", (4, 0), (0, 0), since=2.0)
    first = robot("first", (0, 0), (8, 0), since=1.0)
    met = meet(me, first)

    assert met.on_its_path
    assert met.blocks_it
    assert met.room == 0


def test_a_robot_that_drives_ahead_of_one_that_goes_first_goes_on() -> None:
    me = robot("me", (3, 0), (8, 0), since=2.0)
    first = robot("first", (0, 0), (8, 0), since=1.0)
    met = meet(me, first)

    assert met.on_its_path
    assert not met.blocks_it
    assert math.isinf(met.room)


def test_a_robot_that_is_crossing_a_path_already_goes_on_and_leaves_it() -> None:
    me = robot("me", (5, 0), (5, 6), since=2.0)
    first = robot("first", (0, 0), (8, 0), since=1.0)

    assert not meet(me, first).blocks_it
    assert math.isinf(meet(me, first).room)


def test_a_robot_that_leaves_a_path_backwards_by_the_short_side_does_not_block_it() -> None:
    me = robot("me", (3.0, 3.0), (2.65, 2.8), since=2.0, radius=0.3)
    first = robot("first", (2.8, 3.93), (5.8, 3.1), since=1.0, radius=0.53)
    met = meet(me, first)

    assert met.on_its_path
    assert not met.blocks_it


def test_a_robot_without_a_goal_on_a_path_blocks_it() -> None:
    met = meet(robot("idle", (4, 0.3)), robot("first", (0, 0), (8, 0), since=1.0))

    assert met.on_its_path
    assert met.blocks_it


def test_a_robot_behind_one_that_drives_away_is_not_on_its_path() -> None:
    assert not meet(
        robot("idle", (-0.5, 0)), robot("first", (0, 0), (8, 0), since=1.0)
    ).on_its_path


def test_two_that_are_too_close_already_may_part_but_come_no_nearer() -> None:
    apart = 0.8 + MIN_GAP / 2
    other = robot("other", (0, 0))

    assert math.isinf(meet(robot("me", (apart, 0), (5, 0), since=1.0), other).room)
    assert meet(robot("me", (apart, 0), (-5, 0), since=1.0), other).room < 0.1
