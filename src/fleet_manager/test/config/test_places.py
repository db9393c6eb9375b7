# SPDX-License-Identifier: BSD-3-Clause
"""The traffic planner is told by what names people know the places of a building."""

from __future__ import annotations

import pytest

from blackboard.domain.charger import Charger
from fleet_manager.config.places import landmarks_of, places_of
from hive_common.pose import Pose
from simenv.world.world_file import load_world

WORLD = """
name: house
size: [10.0, 8.0]
walls: [{name: wall, box: [0.0, 0.0, 10.0, 0.2]}]
doors: [{name: the north door, box: [4.0, 6.0, 6.0, 6.2]}]
stations: [{name: bench, pose: [2.0, 3.0, 1.5]}]
parking: [{name: bay, pose: [8.0, 3.0, 0.0]}]
"""
CHARGER = Charger(name="plug", pose=Pose(1.0, 1.0, 0.0))


def test_stations_parking_places_and_chargers_are_goals_and_doors_are_not(tmp_path):
    path = tmp_path / "house.yaml"
    path.write_text(WORLD)
    found = landmarks_of(load_world(str(path)), [CHARGER])

    assert [(each.name, each.at) for each in found if each.is_goal] == [
        ("plug", (1.0, 1.0)),
        ("bench", (2.0, 3.0)),
        ("bay", (8.0, 3.0)),
    ]
    (door,) = (each for each in found if not each.is_goal)
    assert (door.name, door.at) == ("the north door", pytest.approx((5.0, 6.1)))


def test_of_a_real_building_only_the_chargers_are_known():
    assert [each.name for each in landmarks_of(None, [CHARGER])] == ["plug"]


def test_every_station_of_the_lab_is_a_landmark():
    found = {each.name for each in landmarks_of(load_world("lab"), ())}

    assert found == {name for name in places_of("lab") if "charger" not in name}
