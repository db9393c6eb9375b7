# SPDX-License-Identifier: BSD-3-Clause
"""AGVs of every model come to their nodes, and stand there as the order wants."""

import math

import pytest
from shapely.geometry import LineString, Point

from robot_description.models import model_names
from vda5050.protocol.versions import Version
from vda5050.simulated.testing import Rig, node, order


@pytest.mark.parametrize("model", model_names())
@pytest.mark.parametrize("late", [0, 1], ids=["at once", "late"])
def test_every_model_ends_where_and_how_it_should(model, late):
    rig = Rig(Version.V2_1, model, late)
    places = [(2, 2), (6, 2.4), (7, 6), (6, 7), (3, 7), (2.5, 4)]
    way = [node(i, x, y) for i, (x, y) in enumerate(places)]
    rig.send(order([*way, node(6, 3.5, 3.5, theta=-2.0)]))
    rig.run_until(lambda: rig.is_idle and rig.state.last_node_id == "n6", within=200.0)
    rig.run(2.0)

    assert math.dist(rig.pose[:2], (3.5, 3.5)) < 0.1
    assert abs(math.remainder(rig.pose.yaw + 2.0, math.tau)) < 0.06
    assert rig.simulation.collisions == 0
    assert rig.speed == pytest.approx(0.0, abs=1e-6)


def aside(places, pose):
    """Return how far a pose is from a way [m]."""
    return LineString(places).distance(Point(pose[:2]))


def test_an_agv_that_is_stopped_at_a_bend_stops_on_its_way():
    rig = Rig(Version.V2_1, late=1)
    places = [(2, 2), (5, 2), (7.5, 3.3)]
    rig.send(order([node(i, *place) for i, place in enumerate(places)]))
    rig.run_until(lambda: rig.pose.x > 4.6)
    rig.instantly("cancelOrder")
    begin = rig.pose
    rig.run_until(lambda: rig.speed < 0.01)
    assert rig.pose.x > 5.1
    assert rig.pose.distance_to(begin) < 1.5**2 / (2 * 0.8) + 0.5
    assert aside(places, rig.pose) < 0.06
    rig.run_until(lambda: rig.is_idle)


def test_an_agv_at_full_speed_does_not_swing_about_its_way():
    rig = Rig(Version.V2_1, late=1)
    places = [(2, 2), (3.5, 2.6), (8.5, 2.6)]
    rig.send(order([node(i, *place) for i, place in enumerate(places)]))
    rig.run_until(lambda: rig.pose.x > 3.5)
    farthest = 0.0
    while not rig.is_idle:
        rig.run(0.1)
        farthest = max(farthest, aside(places, rig.pose))
    assert farthest < 0.1
