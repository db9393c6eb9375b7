# SPDX-License-Identifier: BSD-3-Clause
"""Robots that stop at random, as often and as long as is said."""

from __future__ import annotations

import pytest

from hive_lab.fleets.delays import CHANCE, LONGEST, SHORTEST, Delays

NAMES = [f"robot{number}" for number in range(20)]
STEP = 0.1  # [s]


def stops(names, seconds, seed=1):
    """Return from when to when each robot stood [s]."""
    delays = Delays(seed)
    found = {name: [] for name in names}
    before = set()
    for step in range(round(seconds / STEP)):
        now = step * STEP
        stopped = delays.stopped(names, now)
        for name in stopped - before:
            found[name].append([now, now])
        for name in stopped:
            found[name][-1][1] = now + STEP
        before = stopped
    return found


def test_robots_stop_with_the_chance_and_for_the_time_that_is_said():
    seconds = 2000.0
    found = [stop for its in stops(NAMES, seconds).values() for stop in its]
    lasted = [end - begin for begin, end in found]

    assert len(found) == pytest.approx(CHANCE * seconds * len(NAMES), rel=0.15)
    assert min(lasted) >= SHORTEST - 1e-6
    assert sum(lasted) / len(lasted) == pytest.approx((SHORTEST + LONGEST) / 2, rel=0.1)
    assert max(lasted) > 0.9 * LONGEST


def test_a_robot_stops_at_the_same_times_in_a_fleet_of_any_size():
    few, many = stops(NAMES[:2], 500.0), stops(NAMES, 500.0)

    assert few == {name: many[name] for name in NAMES[:2]}
    assert few[NAMES[0]] != few[NAMES[1]]
    assert few != stops(NAMES[:2], 500.0, seed=2)
