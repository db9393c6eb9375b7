# SPDX-License-Identifier: BSD-3-Clause
"""Odd messages between robots and the traffic planner end neither, and the next plan is made."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

pytest.importorskip("robot_description.msg", reason="conversions need generated messages")

from hive_common.grid_map import GridMap
from hive_lab.fuzz.mutations import Mutations, as_bytes
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.ros.conversions import (
    routes_from_msg,
    routes_to_msg,
    traffic_from_msg,
    traffic_to_msg,
)
from hive_navigation.traffic.lock_resolver import ResolvingCoordinator
from hive_navigation.traffic.neighbourhood import Neighbourhood
from hive_navigation.traffic.right_of_way import Announcement, Limits, meetings, no_right

SIDE = 10.0  # of the hall [m]
MESSAGES = 400


def robot(name: str, y: float, time: float) -> Announcement:
    """Return what a robot announces at the west wall, with a goal at the east one."""
    return Announcement(
        name=name,
        time=time,
        x=2.0,
        y=y,
        radius=0.4,
        right=no_right(name),
        path=((2.0, y),),
        claim=0.0,
        stationary=False,
        goal=(8.0, y),
        limits=Limits(1.0, 0.5, 1.0),
    )


@pytest.fixture
def coordinator() -> ResolvingCoordinator:
    blocked = np.zeros((200, 200), dtype=bool)
    blocked[:4] = blocked[-4:] = blocked[:, :4] = blocked[:, -4:] = True
    field = ClearanceField.of(GridMap.of_blocked(blocked, SIDE / 200))
    return ResolvingCoordinator(field, build_roadmap(field, [0.4]))


@pytest.mark.parametrize("seed", range(3))
def test_odd_announcements_end_no_planner_and_no_robot_and_the_next_plan_is_made(
    coordinator: ResolvingCoordinator, seed: int
) -> None:
    mutations = Mutations(Random(seed), ["a", "b", "map"])
    heard, refused = Neighbourhood(), 0
    for number in range(MESSAGES):
        now = 100.0 + number
        good = as_bytes(traffic_to_msg(robot("b", 6.0, now), "map"))
        message, what = mutations.mutate(good, type(traffic_to_msg(robot("b", 6.0, now), "map")))
        me = robot("a", 4.0, now)
        try:
            odd = traffic_from_msg(message, now)
        except ValueError:
            refused += 1
            continue
        try:
            for each in (me, odd):
                heard.hear(each)
                coordinator.hear(each)
            meetings(me, heard.near(me, 5.0, 5.0))
            coordinator.step(now)
        except Exception as error:
            raise AssertionError(what) from error

    now += 100.0  # when the odd ones have been silent for so long that they are forgotten
    for name, y in (("c", 4.0), ("d", 6.0)):
        coordinator.hear(robot(name, y, now))
    routes = coordinator.step(now)
    assert {route.robot: route.complete for route in routes} == {"c": True, "d": True}
    assert MESSAGES / 10 < refused < MESSAGES / 2


@pytest.mark.parametrize("seed", range(3))
def test_odd_routes_are_refused_or_can_be_followed(
    coordinator: ResolvingCoordinator, seed: int
) -> None:
    coordinator.hear(robot("a", 4.0, 100.0))
    [route] = coordinator.step(100.0)
    message = routes_to_msg(route.plan, [route], 100.0, "map")
    mutations = Mutations(Random(seed), ["a", "b"])
    taken = 0
    for _ in range(MESSAGES):
        odd, what = mutations.mutate(as_bytes(message), type(message))
        try:
            routes_from_msg(odd)
            taken += 1
        except ValueError:
            continue
        except Exception as error:
            raise AssertionError(what) from error

    assert MESSAGES / 4 < taken < MESSAGES
