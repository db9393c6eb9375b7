# SPDX-License-Identifier: BSD-3-Clause
"""When the rounds of a control loop are due."""

from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="the surroundings need generated messages")

import rospy

from robot_navigation.ros import surroundings
from robot_navigation.ros.surroundings import Surroundings, _Rounds

PERIOD = 1 / 12
STEP = 0.025  # of the clock [s]


def rounds_at(times):
    """Return the times at which a round was done."""
    done = []
    rounds = _Rounds(PERIOD, lambda: done.append(now))
    for now in times:
        rounds.call_if_due(now)
    return done


def clock(start, seconds):
    return [start + STEP * number for number in range(round(seconds / STEP))]


def test_the_first_round_is_done_at_once_and_then_one_in_each_period():
    done = rounds_at(clock(50.01, 10.0))

    assert done[0] == 50.01
    assert len(done) == pytest.approx(120, abs=1)


def test_loops_that_begin_at_different_times_do_their_rounds_at_the_same():
    early, late = rounds_at(clock(0.0, 10.0)), rounds_at(clock(0.425, 9.575))

    assert late[1:] == pytest.approx(early[-len(late) + 1 :])


def test_rounds_at_whole_multiples_of_the_period_are_done_once_each():
    times = [number * PERIOD for number in range(1, 1000)]

    assert rounds_at(times) == times


def test_missed_rounds_are_left_out():
    assert rounds_at([1.0, 5.0, 5.01]) == [1.0, 5.0]


def test_after_the_clock_was_set_back_rounds_go_on():
    assert len(rounds_at([100.0, 3.0, 3.01, 3.1])) == 3


@pytest.fixture
def looped(monkeypatch):
    """Run a control loop for which ROS time goes by as told; return what it did at which time."""

    def run(*times):
        time = SimpleNamespace(now=times[0], left=list(times[1:]))

        def pass_time(_seconds):
            time.now = time.left.pop(0)

        for name in ("Publisher", "Subscriber"):
            monkeypatch.setattr(rospy, name, lambda *_, **__: None)
        monkeypatch.setattr(surroundings, "Transforms", lambda **_: None)
        monkeypatch.setattr(rospy, "get_time", lambda: time.now)
        monkeypatch.setattr(rospy, "is_shutdown", lambda: not time.left)
        monkeypatch.setattr(rospy, "sleep", pass_time)
        monkeypatch.setattr(rospy, "logwarn", lambda _text: None)
        loop, done = Surroundings("/"), []
        before = loop.heard
        loop.when_set_back(lambda: done.append(("anew", time.now, loop.heard is before)))
        loop.every(PERIOD, lambda: done.append(("round", time.now)))
        loop.run()
        return done

    return run


def test_when_time_is_set_back_all_is_forgotten_and_begins_anew_before_the_next_round(looped):
    assert looped(100.0, 100.1, 5.0, 5.1, 5.2) == [
        ("round", 100.0),
        ("round", 100.1),
        ("anew", 5.0, False),
        ("round", 5.0),
        ("round", 5.1),
    ]


def test_while_time_goes_on_nothing_begins_anew(looped):
    assert [what for what, *_ in looped(5.0, 5.1, 5.1, 65.0, 65.1)] == ["round"] * 3
