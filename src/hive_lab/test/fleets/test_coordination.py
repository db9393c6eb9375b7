# SPDX-License-Identifier: BSD-3-Clause
"""What a robot does until the traffic planner has a route for it."""

import math

import pytest

from hive_lab.fleets.coordination import by_a_plan
from hive_lab.fleets.sites import hall
from robot_description.models import load_model
from simenv.simulation import Simulation

EAST = 0.0


def test_a_robot_that_awaits_its_route_turns_and_does_not_drive():
    site = hall()
    simulation = Simulation(site.world, seed=1)
    traffic = by_a_plan(["ld60"], (), simulation, site)
    traffic.add("robot1", load_model("ld60"), (12.0, 4.0, EAST))
    for _ in range(60):  # it hears the planner
        traffic.step()
    planner, traffic.coordinator = traffic.coordinator, None
    traffic.send("robot1", (8.0, 4.0, EAST))
    for _ in range(40):
        traffic.step()
    pose = simulation.poses["robot1"]
    traffic.coordinator = planner

    assert abs(math.remainder(pose.yaw - EAST, math.tau)) > 0.5
    assert pose[:2] == pytest.approx((12.0, 4.0), abs=0.02)
    assert traffic.run(30.0)
    assert traffic.outcomes["robot1"].reached
