# SPDX-License-Identifier: BSD-3-Clause
"""How the navigation comes by the map, and by one that replaces it."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")

import rospy
from std_msgs.msg import Header

from hive_common.errors import MapError
from hive_common.grid_map import GridMap
from hive_common.map_id import checksum_of
from hive_common.ros.conversions import map_msg
from hive_navigation.ros.map_topic import MapTopic
from hive_navigation.ros.traffic_ears import Ears

if TYPE_CHECKING:
    from collections.abc import Callable

FIRST = GridMap.of_blocked(np.zeros((20, 30), dtype=bool), 0.1)
SECOND = GridMap.of_blocked(np.eye(20, 30, dtype=bool), 0.1)
THIRD = GridMap.of_blocked(np.eye(20, 30, 5, dtype=bool), 0.1)
USELESS = GridMap(np.zeros((0, 0), dtype=np.int8), 0.1)


class Wire:
    """Stands for ROS: hands the maps of the test to who subscribes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.warned: list[str] = []
        self.is_shutdown = False
        self._hear: dict[str, Callable[[Any], None]] = {}
        monkeypatch.setattr(rospy, "Subscriber", self._subscribe)
        monkeypatch.setattr(rospy, "logwarn", self.warned.append)
        monkeypatch.setattr(rospy, "logerr", self.warned.append)
        monkeypatch.setattr(rospy, "is_shutdown", lambda: self.is_shutdown)

    def _subscribe(self, topic: str, _: type, hear: Callable[[Any], None], **__: object) -> None:
        self._hear[topic] = hear

    def send(self, grid: GridMap, topic: str = "/map") -> None:
        """Send a map, and wait until it is taken in."""
        self.put(grid, topic)
        self._hear[topic].__self__.join()  # type: ignore[attr-defined]  # of a queue

    def put(self, grid: GridMap, topic: str = "/map") -> None:
        """Send a map."""
        self._hear[topic](map_msg(Header(), grid))


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    return Wire(monkeypatch)


def test_the_first_map_is_waited_for_and_whoever_waits_may_do_something_meanwhile(
    wire: Wire,
) -> None:
    topic, waited = MapTopic("/east/"), []

    def go_on() -> None:
        waited.append(topic.checksum)
        if len(waited) == 3:
            wire.send(FIRST, "/east/map")

    chart = topic.chart(go_on)

    assert (chart.cells == FIRST.cells).all()
    assert waited == ["", "", ""]
    assert topic.checksum == checksum_of(FIRST)


def test_who_waits_for_a_map_is_woken_by_the_end_of_the_node(wire: Wire) -> None:
    wire.is_shutdown = True

    with pytest.raises(rospy.ROSInterruptException):
        MapTopic("/").chart()


def test_a_later_map_is_handed_on_and_the_same_one_again_is_not(wire: Wire) -> None:
    topic = MapTopic("/")
    taken: list[tuple[str, str]] = []
    topic.follow(lambda chart: taken.append((checksum_of(chart), topic.checksum)))
    for grid in (FIRST, FIRST, SECOND, SECOND, FIRST):
        wire.send(grid)

    first, second = checksum_of(FIRST), checksum_of(SECOND)
    assert taken == [(second, second), (first, first)]
    assert (topic.chart().cells == FIRST.cells).all()


def test_a_first_map_that_cannot_be_used_ends_who_waits_for_it(wire: Wire) -> None:
    topic = MapTopic("/")
    wire.send(USELESS)

    with pytest.raises(MapError):
        topic.chart()


def test_a_later_map_that_cannot_be_used_is_ignored_and_said(wire: Wire) -> None:
    topic = MapTopic("/")
    taken: list[GridMap] = []
    topic.follow(taken.append)
    wire.send(FIRST)
    wire.send(USELESS)

    assert taken == []
    assert topic.checksum == checksum_of(FIRST)
    assert wire.warned[0].startswith("a new map is ignored: ")


def test_the_traffic_planner_hears_the_map_of_its_hive(wire: Wire) -> None:
    ears = Ears("/east/")
    wire.send(FIRST, "/east/map")

    assert (ears.map.chart().cells == FIRST.cells).all()


def test_a_map_that_somebody_cannot_take_in_does_not_keep_the_next_one_out(wire: Wire) -> None:
    topic = MapTopic("/")
    wire.send(FIRST)
    taken: list[str] = []

    def fail_once(chart: GridMap) -> None:
        taken.append(checksum_of(chart))
        if len(taken) == 1:
            raise RuntimeError("no memory")

    topic.follow(fail_once)
    wire.send(SECOND)
    wire.send(FIRST)

    assert taken == [checksum_of(SECOND), checksum_of(FIRST)]
    assert "no memory" in wire.warned[0]


def test_reading_goes_on_while_a_map_is_taken_in_and_of_later_ones_the_last_counts(
    wire: Wire,
) -> None:
    topic = MapTopic("/")
    wire.send(FIRST)
    begun, may_end = threading.Event(), threading.Event()
    taken: list[str] = []

    def take(chart: GridMap) -> None:
        taken.append(checksum_of(chart))
        begun.set()
        may_end.wait()

    topic.follow(take)
    wire.put(SECOND)
    begun.wait()
    for grid in (FIRST, SECOND, THIRD):
        wire.put(grid)
    may_end.set()
    wire.send(THIRD)

    assert taken == [checksum_of(SECOND), checksum_of(THIRD)]
