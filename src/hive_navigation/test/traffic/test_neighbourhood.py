# SPDX-License-Identifier: BSD-3-Clause
"""Whom a robot asks for: those that it may see or meet, and nobody who has been silent."""

from __future__ import annotations

import numpy as np

from hive_common.last_heard import FORGOTTEN_AFTER
from hive_navigation.traffic.neighbourhood import Neighbourhood
from hive_navigation.traffic.right_of_way import MOST, SIDE, Announcement, meetings, no_right

Point = tuple[float, float]

SIGHT = 3.0
SILENCE = 2.0


def robot(name: str, *path: Point, time: float = 0.0) -> Announcement:
    x, y = path[0]
    return Announcement(name, time, x, y, 0.4, no_right(name), path, 0.3, stationary=False)


def names(heard: Neighbourhood, me: Announcement) -> list[str]:
    return [other.name for other in heard.near(me, SIGHT, SILENCE)]


def test_a_robot_asks_for_those_it_sees_and_those_whose_paths_it_meets() -> None:
    heard = Neighbourhood()
    me = robot("me", (0.0, 0.0), (8.0, 0.0))
    for other in (
        me,
        robot("far", (0.0, 60.0), (8.0, 60.0)),
        robot("crossing", (5.0, -7.0), (5.0, 1.0)),
        robot("seen", (-3.2, 0.0)),
    ):
        heard.hear(other)

    assert names(heard, me) == ["crossing", "seen"]


def test_whoever_is_left_out_would_change_nothing() -> None:
    random = np.random.default_rng(2)
    heard, robots = Neighbourhood(), []
    for number in range(60):
        corners = np.cumsum(random.uniform(-4.0, 4.0, (3, 2)), axis=0) + random.uniform(0, 30, 2)
        robots.append(robot(f"r{number}", *((float(x), float(y)) for x, y in corners)))
        heard.hear(robots[-1])

    for me in robots:
        near = heard.near(me, SIGHT, SILENCE)
        left_out = [other for other in robots if other not in near]

        assert near == [other for other in robots if other in near]
        assert all(met.room == np.inf and not met.on_its_path for met in meetings(me, left_out))


def test_a_robot_that_moved_on_is_found_where_it_is_now() -> None:
    heard = Neighbourhood()
    heard.hear(robot("other", (1.0, 0.0)))
    heard.hear(robot("other", (1.0 + 10 * SIDE, 0.0)))

    assert names(heard, robot("me", (0.0, 0.0))) == []
    assert names(heard, robot("me", (10 * SIDE, 0.0))) == ["other"]


def test_a_robot_that_has_been_silent_is_left_out() -> None:
    heard = Neighbourhood()
    heard.hear(robot("silent", (1.0, 0.0), time=0.0))
    heard.hear(robot("heard", (2.0, 0.0), time=1.0))
    me = robot("me", (0.0, 0.0), time=SILENCE)

    assert names(heard, me) == ["heard"]
    assert [other.name for other in heard.others("me", SILENCE, SILENCE)] == ["heard"]


def test_a_path_without_end_is_near_everybody_and_costs_no_more_squares() -> None:
    heard = Neighbourhood()
    endless = robot("endless", (0.0, 0.0), (1e6, 1e6))
    heard.hear(endless)

    assert len(endless.squares) < MOST
    assert names(heard, robot("me", (5000.0, 5000.0))) == ["endless"]


def test_robots_that_have_left_are_forgotten_with_the_squares_in_which_they_were() -> None:
    heard = Neighbourhood()
    for number in range(100):
        now = number * FORGOTTEN_AFTER / 4
        heard.hear(robot(f"r{number}", (number * 10 * SIDE, 0.0), time=now))
        heard.hear(robot("stays", (0.0, number * 10 * SIDE), time=now))

    assert heard.latest("r0") is None
    assert heard.latest("r99") is not None
    known = [other.name for other in heard.others("", now, np.inf)]
    assert known == ["stays", "r96", "r97", "r98", "r99"]
    assert set().union(*heard._squares.values()) == {heard._numbers.get(name) for name in known}  # noqa: SLF001  (what it keeps)
    assert all(heard._squares.values())  # noqa: SLF001  (as above)


def test_a_robot_that_comes_back_is_found_where_it_is_now() -> None:
    heard = Neighbourhood()
    heard.hear(robot("back", (1.0, 0.0)))
    heard.hear(robot("other", (1.0, 0.0), time=FORGOTTEN_AFTER))
    heard.hear(robot("back", (2.0, 0.0), time=FORGOTTEN_AFTER))

    assert names(heard, robot("me", (0.0, 0.0), time=FORGOTTEN_AFTER)) == ["other", "back"]
