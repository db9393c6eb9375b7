# SPDX-License-Identifier: BSD-3-Clause
"""The path that windows and RViz draw for a robot."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy
from nav_msgs.msg import Path as PathMsg

from hive_common.ros.names import RobotNames
from hive_navigation.planning.path import Path
from hive_navigation.ros.path_teller import PathTeller

THERE = [(1.0, 2.0), (4.0, 2.0)]
AND_ON = [*THERE, (4.0, 5.0)]


class Wire:
    """Stands for ROS: keeps what is published on a latched topic."""

    def __init__(self) -> None:
        self.said: list[tuple[str, Any]] = []

    def publisher(self, topic: str, kind: type, **how: Any) -> Wire:
        assert (kind, how["latch"]) == (PathMsg, True)
        self._topic = topic
        return self

    def publish(self, message: Any) -> None:
        self.said.append((self._topic, message))


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    wire = Wire()
    monkeypatch.setattr(rospy, "Publisher", wire.publisher)
    return wire


def points(message: Any) -> list[tuple[float, float]]:
    return [(each.pose.position.x, each.pose.position.y) for each in message.poses]


def test_a_path_is_told_once_and_again_when_it_changes_and_when_there_is_none(wire: Wire) -> None:
    teller = PathTeller(RobotNames("/hall/", "agv1"), "map")
    there, and_on = Path(THERE), Path(AND_ON)

    for second, path in enumerate([None, there, there, and_on, None, None]):
        teller.tell(path, rospy.Time(second))

    told = [message for _, message in wire.said]
    assert {topic for topic, _ in wire.said} == {"/hall/agv1/move_base/plan"}
    assert [points(each) for each in told] == [THERE, AND_ON, []]
    assert [each.header.stamp.secs for each in told] == [1, 3, 4]
    assert {each.header.frame_id for each in told} == {"map"}
