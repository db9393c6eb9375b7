# SPDX-License-Identifier: BSD-3-Clause
"""The windows' link learns the building from the ROS master, and goes on without one."""

import pytest

pytest.importorskip("simenv.msg", reason="the link needs generated messages")

from fleet_manager.desk.facts import PlacesKnown, ZonesKnown
from fleet_manager.desk.places import Place
from fleet_manager.ros import desk_link
from fleet_manager.ros.desk_link import RosDeskLink
from hive_common.pose import Pose
from hive_common.zone import Zone

DOOR = Zone(name="door", kind="no-stopping", corners=((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)))
CELL = Pose(1.0, 2.0, 0.0)


class Building:
    """What the ROS master knows of a building; it may be gone."""

    def __init__(self):
        self.places = {}
        self.zones = ()
        self.is_up = True

    def all_zones(self, _hive):
        if not self.is_up:
            raise ConnectionRefusedError
        return self.zones


@pytest.fixture
def building(monkeypatch):
    building = Building()
    monkeypatch.setattr(desk_link, "hive_places", lambda: building.places)
    monkeypatch.setattr(desk_link, "zones_of", building.all_zones)
    return building


def told(link):
    """Return what the link has told of the building since the last call."""
    link._read_building()  # noqa: SLF001  (its thread does so, with a master)
    return [fact for fact in link.drain(10) if isinstance(fact, PlacesKnown | ZonesKnown)]


def test_places_and_zones_are_told_when_they_come_and_when_they_change(building):
    link = RosDeskLink("window", [])
    assert told(link) == []

    building.places, building.zones = {"cell": CELL}, (DOOR,)
    assert told(link) == [PlacesKnown((Place("cell", CELL),)), ZonesKnown((DOOR,))]
    assert told(link) == []

    building.places = {"shelf": CELL}
    assert told(link) == [PlacesKnown((Place("shelf", CELL),))]


def test_a_master_that_is_gone_or_knows_nothing_takes_no_zones_away(building):
    link = RosDeskLink("window", [])
    building.zones = (DOOR,)
    told(link)

    building.is_up = False
    assert told(link) == []
    building.is_up, building.zones = True, ()
    assert told(link) == []


def test_a_window_without_a_map_needs_no_zones(building):
    building.zones = (DOOR,)

    assert told(RosDeskLink("window", [], shows_map=False)) == []


def test_a_robot_that_is_met_without_a_master_ends_nothing(building, monkeypatch):
    building.is_up, followed = False, []
    monkeypatch.setattr(
        desk_link.MapTopics, "listen_to_drive", lambda _, name: followed.append(name)
    )
    monkeypatch.setattr(desk_link.HiveTopics, "advertise_to", lambda *_: None)
    link = RosDeskLink("window", [])

    link._meet("robot9")  # noqa: SLF001  (rospy's thread does so)
    link._work.run_for(0.0)  # noqa: SLF001  (its own thread does so)

    assert followed == ["robot9"]
