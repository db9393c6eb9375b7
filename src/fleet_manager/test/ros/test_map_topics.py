# SPDX-License-Identifier: BSD-3-Clause
"""What windows make of a map that comes as a message."""

import math

import numpy as np
import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

import rospy
from std_msgs.msg import Header

from fleet_manager.ros.map_topics import MapTopics
from hive_common.grid_map import FREE, OCCUPIED
from hive_common.pose import Pose, compose
from hive_common.ros.conversions import map_msg
from hive_common.turned_map import TurnedMap


@pytest.fixture
def told():
    return []


@pytest.fixture
def topics(told):
    return MapTopics(lambda fact, *_: told.append(fact))


@pytest.mark.parametrize("yaw", [0.5, math.pi / 2, -2.0])
def test_windows_show_a_map_that_is_turned_where_it_is(topics, told, yaw):
    cells = np.full((40, 60), FREE, dtype=np.int8)
    cells[30, 50] = OCCUPIED
    origin = Pose(-4.0, 7.0, yaw)

    topics._hear_map(map_msg(Header(), TurnedMap(cells, 0.1, origin)))  # noqa: SLF001  (rospy does so)

    (known,) = told
    shown = known.levels[0]
    x, y, _ = compose(origin, Pose(5.05, 3.05))
    assert shown.cells[shown.cell((x, y))] == OCCUPIED
    assert 1 <= (shown.cells == OCCUPIED).sum() <= 9
    corner = compose(origin, Pose(0.15, 0.15))
    assert shown.cells[shown.cell(corner)] == FREE
    assert known.bounds.x_min <= min(x, corner.x) < known.bounds.x_max


def test_windows_ignore_a_map_that_cannot_be_used_and_say_why(topics, told, monkeypatch):
    said = []
    monkeypatch.setattr(rospy, "logwarn_throttle_identical", lambda _, line: said.append(line))
    tilted = map_msg(Header(), TurnedMap(np.zeros((2, 2), dtype=np.int8), 0.1, Pose(0.0, 0.0)))
    tilted.info.origin.orientation.x, tilted.info.origin.orientation.w = 1.0, 0.0

    topics._hear_map(tilted)  # noqa: SLF001  (rospy does so)

    assert told == []
    assert len(said) == 1
    assert "a map is ignored: the map's origin is tilted" in said[0]
