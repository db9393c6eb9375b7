# SPDX-License-Identifier: BSD-3-Clause
"""How the path lengths of a virtual fleet hear of closed zones and of delays."""

import pytest

pytest.importorskip("ompl")

from attrs import evolve

from blackboard.costing.traffic_conditions import DELAYS_PERIOD
from fleet_manager.config.fleet_file import read_fleet
from hive_common.pose import Pose
from hive_lab.fleets.simulated_bodies import SimulatedBodies
from hive_lab.fleets.sites import LANE, LOWER_DOOR, lab
from hive_lab.fleets.told_traffic import ToldTraffic
from hive_lab.fleets.virtual_fleet import VirtualFleet
from hive_navigation.traffic.coordinator import Waiting

LAB = read_fleet("lab")
IN_DOOR = ((LOWER_DOOR[0] + LOWER_DOOR[2]) / 2, (LOWER_DOOR[1] + LOWER_DOOR[3]) / 2)
HERE, THERE = Pose(IN_DOOR[0] - 1.5, IN_DOOR[1]), Pose(IN_DOOR[0] + 1.5, IN_DOOR[1])


@pytest.fixture
def told():
    """Return a fleet of one robot, its bodies, and what it is told."""
    robots = evolve(LAB, robots=LAB.robots[:1])
    models = [robot.model for robot in robots.robots]
    bodies = SimulatedBodies("lab", 1, models=models, zones=lab().zones)
    fleet = VirtualFleet(robots, "lab", bodies, {})
    return fleet, bodies, ToldTraffic(fleet, bodies)


def test_a_closed_lane_makes_all_paths_longer_at_once_until_it_opens(told):
    fleet, bodies, traffic = told

    def lengths():
        each = (fleet.board_lengths, *fleet.path_lengths.values())
        return [lengths.length(HERE, THERE) for lengths in each]

    before = lengths()
    traffic.close(LANE)
    closed, at_the_planner = lengths(), bodies.coordinator.roadmap.closed
    traffic.open(LANE)

    assert min(closed) > 2 * max(before)
    assert at_the_planner == {LANE}
    assert lengths() == before
    assert not bodies.coordinator.roadmap.closed


def test_new_delays_count_every_so_often_only(told, monkeypatch):
    fleet, bodies, _ = told
    waits = [Waiting("robot1", "robot2", IN_DOOR, 0.0)]
    monkeypatch.setattr(bodies.coordinator, "waiting", lambda: waits)
    delays = []

    for _ in range(round(2.5 * DELAYS_PERIOD)):
        fleet.run(1.0)
        delays.append(fleet.path_lengths["robot1"].length_and_delay(HERE, THERE)[1])

    changes = [at for at in range(1, len(delays)) if delays[at] != delays[at - 1]]
    assert changes == [DELAYS_PERIOD, 2 * DELAYS_PERIOD]
    assert delays[0] == pytest.approx(0.0)
    assert delays[changes[0]] > DELAYS_PERIOD / 10


def test_bodies_without_a_traffic_planner_are_refused():
    bodies = SimulatedBodies("lab", 1)
    fleet = VirtualFleet(evolve(LAB, robots=LAB.robots[:1]), "lab", bodies, {})

    with pytest.raises(ValueError, match="give SimulatedBodies the models"):
        ToldTraffic(fleet, bodies)
