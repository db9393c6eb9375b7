# SPDX-License-Identifier: BSD-3-Clause
"""The named places of the hive's building."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from fleet_manager.ros import place_parameter
from hive_common.pose import Pose


@pytest.mark.parametrize(
    "found",
    [[], "dock", 7, [{"name": "dock"}, {"pose": [1, 2]}, 7, {"name": "bay", "pose": ["x"]}]],
)
def test_what_is_no_place_is_left_out(monkeypatch, found):
    monkeypatch.setattr(place_parameter.rospy, "get_param", lambda _name, _default: found)

    assert place_parameter.hive_places() == {}


def test_places_are_read_by_name(monkeypatch):
    found = [{"name": "dock", "pose": [1, 2, 0.5]}, {"name": "far", "pose": [1e300, 0, 0]}]
    monkeypatch.setattr(place_parameter.rospy, "get_param", lambda _name, _default: found)

    assert place_parameter.hive_places() == {"dock": Pose(1.0, 2.0, 0.5)}
