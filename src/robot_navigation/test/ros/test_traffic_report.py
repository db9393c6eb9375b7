# SPDX-License-Identifier: BSD-3-Clause
"""What an operator is told about traffic, from who waits for whom second by second."""

import pytest

from robot_navigation.ros.traffic_report import (
    LONG,
    MOST_PLACES,
    WINDOW,
    TrafficReport,
    Waiting,
    cycles,
)


def waits(*pairs, since=0.0, x=1.0, y=1.0):
    """Return robots that wait at one place, from pairs of who and for whom."""
    return [Waiting(robot, other, x, y, since) for robot, other in pairs]


@pytest.mark.parametrize(
    ("pairs", "found"),
    [
        ([], []),
        (["ab"], []),
        (["ab", "bc"], []),
        (["ab", "ba"], ["ab"]),
        (["ab", "bc", "ca"], ["abc"]),
        (["da", "ab", "bc", "ca"], ["abc"]),
        (["ab", "ba", "cd", "dc", "ea"], ["ab", "cd"]),
        (["aa"], ["a"]),
    ],
)
def test_robots_that_wait_in_a_circle_are_found_without_those_that_wait_for_them(pairs, found):
    assert cycles(waits(*pairs)) == {frozenset(each) for each in found}


def test_a_circle_counts_once_however_long_it_lasts():
    report = TrafficReport()
    for now in range(20):
        report.note(float(now), waits("ab", "ba"))

    assert report.deadlocks == 1


def test_a_circle_that_comes_again_counts_again():
    report = TrafficReport()
    for now, who in enumerate((["ab", "ba"], [], ["ab", "ba"])):
        report.note(float(now), waits(*who))

    assert report.deadlocks == 2
    assert report.cycles == {frozenset("ab")}


def test_only_robots_that_wait_for_long_stand():
    report = TrafficReport()
    report.note(LONG + 5.0, [*waits("ab", since=1.0), *waits("cd", since=20.0)])

    assert [wait.robot for wait in report.standing()] == ["a"]


def test_the_time_that_robots_have_waited_at_a_place_is_added_up():
    report = TrafficReport()
    for now in range(10, 21):
        report.note(float(now), [*waits("ab", since=10.0), *waits("cb", since=15.5, x=1.4)])
    (place,) = report.slowest()

    assert place.waited == pytest.approx(10.0 + 4.5)
    assert place.waits == 2
    assert 1.0 < place.x < 1.4


def test_the_slowest_places_come_first_and_are_few():
    report = TrafficReport()
    for now in range(30):
        there = [Waiting(f"r{n}", "a", 10.0 * n, 0.0, 0.0) for n in range(20) if now <= 1 + n]
        report.note(float(now), there)
    xs = [place.x for place in report.slowest()]

    assert len(xs) == MOST_PLACES
    assert xs[:3] == [190.0, 180.0, 170.0]


def test_what_was_long_ago_is_forgotten():
    report = TrafficReport()
    report.note(0.0, waits("ab"))
    report.note(5.0, waits("ab"))
    report.note(WINDOW + 6.0, [])

    assert report.slowest() == []


def test_after_the_clock_was_set_back_waiting_is_counted_anew():
    report = TrafficReport()
    report.note(500.0, waits("ab", since=400.0))
    report.note(1.0, [])
    report.note(2.0, waits("ab", since=1.5))

    assert [place.waited for place in report.slowest()] == pytest.approx([0.5])
