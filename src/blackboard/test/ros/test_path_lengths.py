# SPDX-License-Identifier: BSD-3-Clause
"""Path lengths of a member without a map, and on maps that replace each other."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("blackboard.msg", reason="needs generated messages")

import rospy
from robot_description.msg import MapInUse
from std_msgs.msg import Header

from blackboard.domain.settings import PathSettings
from blackboard.ros import path_lengths
from blackboard.ros.path_lengths import RosPathLengths
from hive_common.grid_map import GridMap
from hive_common.map_id import NO_MAP, MapId, checksum_of
from hive_common.pose import Pose
from hive_common.ros.conversions import map_msg

HERE, THERE = Pose(1.0, 2.0), Pose(3.0, 2.0)


def hall(wall_up_to=0):
    """Return a hall of 4 m x 4 m, with a wall in its middle up to a row."""
    blocked = np.zeros((40, 40), dtype=bool)
    blocked[:wall_up_to, 20] = True
    return GridMap.of_blocked(blocked, 0.1)


def test_without_a_map_robots_of_all_radii_share_their_lengths_so_that_a_plan_computes_them_once():
    lengths = RosPathLengths(None, "/", PathSettings(distance="euclidean"))

    assert lengths.of(0.3) is lengths.of(0.5)


class Wire:
    """Stands for ROS and a talker that hands on at once."""

    def __init__(self, monkeypatch):
        self.told = []
        self.warned = []
        self._hear = {}
        monkeypatch.setattr(rospy, "Subscriber", self._subscribe)
        monkeypatch.setattr(rospy, "loginfo", lambda _: None)
        monkeypatch.setattr(rospy, "logwarn", self.warned.append)
        monkeypatch.setattr(path_lengths, "wait_for", lambda *_: map_msg(Header(), hall()))
        monkeypatch.setattr(path_lengths.params, "read", lambda *_: SimpleNamespace(traffic=""))
        talker = SimpleNamespace(call=lambda act: act())
        self.lengths = RosPathLengths(talker, "/", PathSettings())
        self.lengths.follow(self.told.append)

    def _subscribe(self, topic, _kind, hear, talker, **_):
        self._hear[topic] = lambda message: hear(message, talker)

    def send(self, grid):
        self._hear["/map"](map_msg(Header(), grid))

    def name(self, grid, name):
        self._hear["/map_in_use"](MapInUse("map_server", name, checksum_of(grid)))


@pytest.fixture
def wire(monkeypatch):
    return Wire(monkeypatch)


def test_ways_lead_over_a_map_that_replaces_the_first_and_it_is_told(wire):
    ways = wire.lengths.of(0.2)
    before = ways.length(HERE, THERE)

    wire.send(hall(wall_up_to=30))

    assert before == pytest.approx(2.0)
    assert ways.length(HERE, THERE) > 2.5
    assert wire.told == [MapId("", checksum_of(hall())), MapId("", checksum_of(hall(30)))]


def test_a_map_that_comes_again_is_told_once(wire):
    wire.send(hall())
    wire.send(hall())

    assert wire.told == [MapId("", checksum_of(hall()))]


@pytest.mark.parametrize("name_first", [True, False])
def test_the_name_of_a_map_is_told_with_it_whichever_comes_first(wire, name_first):
    wire.name(hall(), "old")
    if name_first:
        wire.name(hall(30), "new")
    wire.send(hall(30))
    if not name_first:
        wire.name(hall(30), "new")

    assert MapId("old", checksum_of(hall())) in wire.told
    assert wire.told[-1] == MapId("new", checksum_of(hall(30)))
    assert MapId("old", checksum_of(hall(30))) not in wire.told


def test_a_map_that_cannot_be_used_changes_nothing(wire):
    wire.send(GridMap(np.zeros((0, 0), dtype=np.int8), 0.1))

    assert wire.lengths.of(0.2).length(HERE, THERE) == pytest.approx(2.0)
    assert len(wire.told) == 1
    assert wire.warned[0].startswith("a new map is ignored: ")


def test_a_member_without_a_map_uses_none():
    told = []
    RosPathLengths(None, "/", PathSettings(distance="euclidean")).follow(told.append)

    assert told == [NO_MAP]
