# SPDX-License-Identifier: BSD-3-Clause
"""How what the traffic planner tells of zones reaches the planners of a process's robots."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("robot_description.msg", reason="the surroundings need generated messages")
pytest.importorskip("ompl")

import rospy
from robot_description.msg import TrafficState

from hive_common.grid_map import GridMap
from hive_common.zone import NO_STOPPING, Zone
from hive_navigation.ros import surroundings
from hive_navigation.ros.surroundings import Surroundings

ACROSS = Zone(name="middle", kind=NO_STOPPING, corners=((4, 0), (6, 0), (6, 7), (4, 7)))
HERE, THERE = (2.0, 2.0), (8.0, 2.0)
RADIUS = 0.4


def hall() -> GridMap:
    """Return a map of 10 m x 10 m without walls."""
    return GridMap.of_blocked(np.zeros((200, 200), dtype=bool), 0.05)


class Process:
    """The surroundings of a process, without ROS.

    Attributes:
        changes: How often its robots were told that zones have changed.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.changes, self._hear = 0, {}
        chart = SimpleNamespace(chart=hall, follow=lambda take: setattr(self, "take_map", take))
        monkeypatch.setattr(surroundings, "MapTopic", lambda _: chart)
        monkeypatch.setattr(surroundings, "Transforms", lambda **_: None)
        monkeypatch.setattr(surroundings, "zones_of", lambda _: (ACROSS,))
        monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: None)
        monkeypatch.setattr(rospy, "Subscriber", self._subscribe)
        monkeypatch.setattr(rospy, "get_time", lambda: 100.0)
        monkeypatch.setattr(rospy, "loginfo", lambda _: None)
        self.here = Surroundings("/")
        self.here.planner(RADIUS)
        self.here.when_zones_change(self._note)

    def _subscribe(self, topic: str, _kind: type, hear: Any, **_: object) -> None:
        self._hear[topic] = hear

    def _note(self) -> None:
        self.changes += 1

    def tell(self, epoch: int, *closed: str) -> None:
        """Have the traffic planner of an epoch tell which zones are closed."""
        self._hear["/traffic_state"](TrafficState(epoch=epoch, closed=list(closed)))
        self.here.inbox.empty()

    @property
    def goes_around(self) -> bool:
        """Whether paths lead around the zone."""
        return max(y for _, y in self.here.planner(RADIUS).plan(HERE, THERE)) > 7.0


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch) -> Process:
    return Process(monkeypatch)


def test_robots_plan_around_a_zone_while_it_is_closed(process: Process) -> None:
    assert not process.goes_around

    process.tell(1000, "middle")
    assert process.goes_around

    process.tell(1000)
    assert not process.goes_around
    assert process.changes == 2


def test_what_is_told_again_changes_nothing(process: Process) -> None:
    for _ in range(3):
        process.tell(1000, "middle")

    assert process.changes == 1


def test_a_planner_that_has_been_replaced_is_not_believed(process: Process) -> None:
    process.tell(2000, "middle")
    process.tell(1000)

    assert process.goes_around


def test_on_a_new_map_robots_plan_around_the_zones_that_are_closed(process: Process) -> None:
    process.tell(1000, "middle")
    process.take_map(hall())
    process.here.inbox.empty()
    assert process.goes_around

    process.tell(1000)
    assert not process.goes_around


def test_a_zone_that_closes_while_a_new_map_is_taken_in_counts_on_that_map(
    process: Process,
) -> None:
    process.take_map(hall())  # the control loop has not changed to it yet
    process.tell(1000, "middle")

    assert process.goes_around
