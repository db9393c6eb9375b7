# SPDX-License-Identifier: BSD-3-Clause
"""What a robot's node makes of the maps that the robot's parts tell."""

from types import SimpleNamespace

import pytest

pytest.importorskip("robot_description.msg", reason="needs generated messages")

from robot_description.msg import MapInUse

from blackboard.robot.maps_in_use import MapsInUse
from blackboard.ros.robot_node import _note_map
from hive_common.map_id import MapId


@pytest.mark.parametrize(
    ("message", "is_taken"),
    [
        (MapInUse("amcl", "", "02"), True),
        (MapInUse("a" * 65, "", "02"), False),
        (MapInUse("amcl", "n" * 65, "02"), False),
        (MapInUse("amcl", "", "0" * 65), False),
    ],
)
def test_a_part_is_believed_unless_its_texts_have_no_end(message, is_taken):
    refused = []
    robot = SimpleNamespace(maps=MapsInUse())
    talker = SimpleNamespace(refuse=lambda topic, _why: refused.append(topic))

    _note_map(robot, talker, message)

    assert bool(robot.maps.trouble(MapId("hall", "01"))) is is_taken
    assert refused == ([] if is_taken else ["map_in_use"])
