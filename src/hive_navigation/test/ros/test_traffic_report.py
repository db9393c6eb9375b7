# SPDX-License-Identifier: BSD-3-Clause
"""What an operator is told about traffic, from who waits for whom second by second."""

import pytest

from hive_common.landmark import Landmark
from hive_navigation.ros.traffic_report import (
    LONG,
    MOST_PLACES,
    RECENT,
    WINDOW,
    TrafficReport,
    Waiting,
)
from hive_navigation.traffic.deadlock import CIRCLE_AFTER, Kind, LockWatch
from hive_navigation.traffic.landmarks import Landmarks
from hive_navigation.traffic.right_of_way import Announcement, no_right


def waits(*pairs, since=0.0, x=1.0, y=1.0):
    """Return robots that wait at one place, from pairs of who and for whom."""
    return [Waiting(robot, other, x, y, since) for robot, other in pairs]


@pytest.fixture
def watch():
    return LockWatch()


@pytest.fixture
def report(watch):
    return TrafficReport(Landmarks([Landmark(name="the dock", at=(1.0, 1.0))]), watch)


def test_robots_that_cannot_go_on_are_told_and_counted(report, watch):
    for now in (0.0, CIRCLE_AFTER):
        for name, other in ("ab", "ba"):
            here = (1.0, 1.0)
            watch.hear(
                Announcement(
                    name,
                    now,
                    *here,
                    0.4,
                    no_right(name),
                    (here,),
                    0.0,
                    stationary=False,
                    waits_for=other,
                )
            )
        watch.look(now)
    report.note(CIRCLE_AFTER, waits("ab", "ba"))

    (lock,) = report.locks
    assert lock.text == "a waits for b at the dock, b waits for a at the dock"
    assert (lock.kind, lock.robots) == (Kind.CIRCLE, ("a", "b"))
    assert report.counts[Kind.CIRCLE] == 1


def test_who_waits_is_told_with_the_name_of_the_place(report):
    report.note(1.0, waits("ab"))

    assert [wait.where for wait in report.waits] == ["at the dock"]
    assert [place.where for place in report.slowest()] == ["at the dock"]


def test_only_robots_that_wait_for_long_stand(report):
    report.note(LONG + 5.0, [*waits("ab", since=1.0), *waits("cd", since=20.0)])

    assert [wait.robot for wait in report.standing()] == ["a"]


def test_the_time_that_robots_have_waited_at_a_place_is_added_up(report):
    for now in range(10, 21):
        report.note(float(now), [*waits("ab", since=10.0), *waits("cb", since=15.5, x=1.4)])
    (place,) = report.slowest()

    assert place.waited == pytest.approx(10.0 + 4.5)
    assert place.waits == 2
    assert 1.0 < place.x < 1.4


def test_the_slowest_places_come_first_and_are_few(report):
    for now in range(70):
        there = [Waiting(f"r{n}", "a", 10.0 * n, 0.0, 0.0) for n in range(60) if now <= 1 + n]
        report.note(float(now), there)
    xs = [place.x for place in report.slowest()]

    assert len(xs) == MOST_PLACES
    assert xs[:3] == [590.0, 580.0, 570.0]


def test_what_was_long_ago_is_forgotten(report):
    report.note(0.0, waits("ab"))
    report.note(5.0, waits("ab"))
    report.note(WINDOW + 6.0, [])

    assert report.slowest() == []


def test_after_the_clock_was_set_back_waiting_is_counted_anew(report):
    report.note(500.0, waits("ab", since=400.0))
    report.note(1.0, [])
    report.note(2.0, waits("ab", since=1.5))

    assert [place.waited for place in report.slowest()] == pytest.approx([0.5])


def test_what_a_robot_loses_at_a_place_is_what_all_have_lost_over_how_many_have_passed(report):
    for now in range(10, 21):
        there = {"a": (1.0, 1.0), "c": (-1.0 + 0.4 * (now - 10), 1.0), "d": (9.0, 1.0 * now)}
        report.note(float(now), waits("ab", since=10.0), there)
    (place,) = report.slowest()

    assert place.delay == pytest.approx(10.0)  # c alone has come in

    for now in range(21, 25):
        there = {"a": (1.0, 1.0), "e": (1.0, -1.0 + 0.7 * (now - 21))}
        report.note(float(now), [], there)
    (place,) = report.slowest()

    assert place.delay == pytest.approx(5.0)


def test_what_was_lost_minutes_ago_delays_nobody_any_more(report):
    report.note(0.0, waits("ab"))
    report.note(5.0, waits("ab"))
    report.note(5.0 + RECENT + 1.0, [])
    (place,) = report.slowest()

    assert place.waited == pytest.approx(5.0)
    assert place.delay == 0.0
