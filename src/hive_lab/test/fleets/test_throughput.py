# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet keeps of its throughput is measured also among people and when a lane closes."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("ompl")

from hive_lab.fleets import delays, throughput
from hive_lab.fleets.sites import LOWER_DOOR, SITES
from hive_lab.fleets.throughput import Trouble, measure


@pytest.fixture
def crowds(monkeypatch):
    """The crowds that are measured."""
    made = []

    class Kept(throughput.Crowd):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            made.append(self)

    monkeypatch.setattr(throughput, "Crowd", Kept)
    return made


def test_people_walk_among_the_robots(crowds):
    measure(SITES["lab"](), 2, 2.0, ("ld60",), trouble=Trouble(people=3))
    (crowd,) = crowds

    assert [person.name for person in crowd.simulation.world.people] == [
        "person 1",
        "person 2",
        "person 3",
    ]


def test_robots_stop_at_random_where_they_are_delayed(crowds, monkeypatch):
    monkeypatch.setattr(delays, "CHANCE", 1.0)
    monkeypatch.setattr(delays, "SHORTEST", delays.LONGEST)
    for delayed in (True, False):
        measure(SITES["lab"](), 2, 2.0, ("ld60",), trouble=Trouble(delays=delayed))
    stopped, free = (
        [each.simulation.odometry(name) for name in each.simulation.names] for each in crowds
    )

    assert all(place == pytest.approx((0.0, 0.0, 0.0)) for place in stopped)
    assert any(math.hypot(*place[:2]) > 0.1 for place in free)


def test_a_lane_closes_for_the_middle_third_and_no_goal_is_in_it(crowds, monkeypatch):
    calls = []
    coordinator_of = throughput.by_a_plan

    def noted(*args):
        traffic = coordinator_of(*args)
        simulation = args[2]
        for name in ("close", "open"):
            monkeypatch.setattr(
                traffic.coordinator,
                name,
                lambda zone, name=name: calls.append((name, zone, round(simulation.time, 1))),
            )
        return traffic

    monkeypatch.setattr(throughput, "by_a_plan", noted)
    trouble = Trouble(closes=True)
    measure(SITES["lab"](), 2, 3.0, ("ld60",), planned=True, trouble=trouble)
    (crowd,) = crowds

    assert calls == [("close", "lane", 1.0), ("open", "lane", 2.0)]
    left, low, right, high = LOWER_DOOR
    xs, ys = crowd._places.T  # noqa: SLF001  (where goals are drawn)
    assert not ((xs > left) & (xs < right) & (ys > low) & (ys < high)).any()


def test_the_processor_time_of_plans_is_measured_where_there_is_a_planner():
    planned, local = (
        measure(SITES["lab"](), 2, 3.0, ("ld60",), planned=planned) for planned in (True, False)
    )

    assert 0.0 < planned.plan_median <= planned.plan_p95
    assert (local.plan_median, local.plan_p95) == (0.0, 0.0)
