# SPDX-License-Identifier: BSD-3-Clause
import math

import numpy as np
import pytest
from shapely.geometry import Point, box

from hive_common.pose import Pose
from robot_description.models import load_model
from simenv.noise import NO_NOISE, Noise
from simenv.simulation import Simulation
from simenv.testing import hall
from simenv.world.shapes import Shape

MIR = load_model("mir100")  # laser at the middle of the base
AHEAD, LEFT, BEHIND, RIGHT = 360, 540, 0, 180  # beams of 720


def scan(*shapes, pose=(5.0, 5.0, 0.0), noise=NO_NOISE):
    simulation = Simulation(hall(*shapes), noise=noise)
    simulation.add_robot("robot1", MIR, pose)
    return simulation.scan("robot1")


def test_a_scan_has_720_beams_counter_clockwise_from_behind():
    table = Shape("table", box(6.5, 4.5, 8.0, 5.5))
    post = Shape("post", box(4.9, 7.0, 5.1, 7.5))

    taken = scan(table, post)

    assert len(taken) == 720
    assert taken[AHEAD] == pytest.approx(1.5)
    assert taken[LEFT] == pytest.approx(2.0)
    assert taken[BEHIND] == taken[RIGHT] == math.inf


def test_what_is_farther_than_3_m_is_not_seen():
    table = Shape("table", box(8.01, 4.0, 9.0, 6.0))

    assert np.isinf(scan(table)).all()
    assert scan(table, pose=(5.02, 5.0, 0.0))[AHEAD] == pytest.approx(2.99)


def test_a_round_pillar_looks_round():
    taken = scan(Shape("pillar", Point(6.5, 5.0).buffer(0.5, 8)))

    seen = np.flatnonzero(np.isfinite(taken))
    half_angle = math.asin(0.5 / 1.5)
    assert len(seen) == pytest.approx(2 * half_angle / (2 * math.pi / 720), abs=3)
    assert taken[AHEAD] == pytest.approx(1.0)


def test_a_robot_sees_the_other_robots_but_not_itself():
    simulation = Simulation(hall(), noise=NO_NOISE)
    simulation.add_robot("robot1", MIR, Pose(5.0, 5.0, 0.0))
    assert np.isinf(simulation.scan("robot1")).all()

    simulation.add_robot("robot2", MIR, Pose(7.0, 5.0, math.pi / 2))

    assert simulation.scan("robot1")[AHEAD] == pytest.approx(2.0 - 0.29)
    assert simulation.scan("robot2")[LEFT] == pytest.approx(2.0 - 0.445)


def test_the_walls_of_a_hall_are_seen_all_around_without_a_hole():
    taken = scan(pose=(2.0, 2.0, 0.3))

    angles = (np.arange(720) / 720 - 0.5) * MIR.laser.field_of_view + 0.3
    with np.errstate(divide="ignore"):
        along_x = np.where(np.cos(angles) < 0, -1.5 / np.cos(angles), np.inf)
        along_y = np.where(np.sin(angles) < 0, -1.5 / np.sin(angles), np.inf)
    expected = np.minimum(along_x, along_y)
    expected[expected > 3.0] = np.inf
    assert taken == pytest.approx(expected)


def test_distances_are_as_noisy_as_asked_for():
    table = Shape("table", box(6.0, 2.0, 6.5, 8.0))

    noisy, true = scan(table, noise=Noise(laser=0.05)), scan(table)

    both = np.isfinite(noisy) & (true < 2.8)
    error = noisy[both] - true[both]
    assert np.std(error) == pytest.approx(0.05, rel=0.2)
    assert abs(np.mean(error)) < 0.015


def test_what_is_too_close_to_measure_is_minus_infinity():
    simulation = Simulation(hall(), noise=NO_NOISE)
    simulation.add_robot("robot1", MIR, Pose(5.0, 5.0, 0.0))

    taken = simulation.scanner("robot1").measure(
        Pose(5.0, 5.0, 0.0), np.array([[[5.05, 6.0], [5.05, 4.0]]])
    )

    assert taken[AHEAD] == -math.inf
