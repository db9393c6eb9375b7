# SPDX-License-Identifier: BSD-3-Clause
"""When the traffic planner ends, so that the next one begins anew."""

from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")
pytest.importorskip("ompl")

import rospy

from hive_navigation.ros.traffic_planner import TrafficPlanner


def test_it_ends_when_there_is_another_map_than_the_one_of_its_roadmap(monkeypatch):
    warned = []
    monkeypatch.setattr(rospy, "get_time", lambda: 1.0)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy, "logwarn", warned.append)
    planner = TrafficPlanner.__new__(TrafficPlanner)  # its constructor makes a roadmap
    planner._checksum = "01"  # noqa: SLF001  (see above)
    planner._ears = SimpleNamespace(map=SimpleNamespace(checksum="02"))  # noqa: SLF001  (see above)

    planner.run()

    assert warned == ["there is a new map: the next traffic planner begins anew on it"]
