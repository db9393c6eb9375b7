# SPDX-License-Identifier: BSD-3-Clause
import math

import numpy as np
import pytest

from robot_description.models import load_model
from simenv.bodies.motion import MASS, accelerated, driven, limits_of, moved, within_limits

MIR = load_model("mir100")  # differential
YOUBOT = load_model("youbot")  # holonomic
LIMITS = limits_of([MIR, YOUBOT])


def test_speeds_over_the_limit_are_cut_to_it_for_each_robot():
    fast = np.array([[9.0, 0.0, 9.0], [9.0, 0.0, -9.0]])

    allowed = within_limits(fast, LIMITS)

    assert allowed[0] == pytest.approx([MIR.base.max_speed, 0.0, MIR.base.max_yaw_rate])
    assert allowed[1] == pytest.approx([YOUBOT.base.max_speed, 0.0, -YOUBOT.base.max_yaw_rate])


def test_speeds_below_the_limit_stay_as_they_are():
    slow = np.array([[0.3, 0.0, -0.2], [-0.3, 0.2, 0.1]])

    assert within_limits(slow, LIMITS) == pytest.approx(slow)


def test_a_differential_base_does_not_go_sideways():
    allowed = within_limits(np.array([[0.2, 0.5, 0.0], [0.2, 0.5, 0.0]]), LIMITS)

    assert allowed[0, 1] == 0.0
    assert allowed[1, 1] == 0.5


def test_a_holonomic_base_is_slower_on_the_diagonal_and_keeps_its_direction():
    for angle in np.linspace(0, 2 * math.pi, 17):
        command = 5.0 * np.array([math.cos(angle), math.sin(angle), 0.0])

        _, allowed = within_limits(np.stack([command, command]), LIMITS)

        speed = math.hypot(allowed[0], allowed[1])
        assert math.isclose(
            math.remainder(math.atan2(allowed[1], allowed[0]) - angle, math.tau), 0.0, abs_tol=1e-9
        )
        assert YOUBOT.base.max_speed_diagonal - 1e-9 <= speed <= YOUBOT.base.max_speed + 1e-9
    diagonal = within_limits(np.full((2, 3), 5.0), LIMITS)[1]
    assert math.hypot(diagonal[0], diagonal[1]) == pytest.approx(YOUBOT.base.max_speed_diagonal)


def test_speed_changes_no_faster_than_the_acceleration_allows():
    still = np.zeros((2, 3))
    targets = np.array([[1.0, 0.0, 1.0], [0.3, 0.4, -1.0]])

    after = accelerated(still, targets, LIMITS, np.zeros(2), 0.1)

    assert after[0] == pytest.approx(
        [MIR.base.acceleration * 0.1, 0.0, MIR.base.yaw_acceleration * 0.1]
    )
    assert np.hypot(*after[1, :2]) == pytest.approx(YOUBOT.base.acceleration * 0.1)
    assert after[1, 1] / after[1, 0] == pytest.approx(4 / 3)


def test_speed_settles_exactly_on_what_is_commanded():
    velocities = np.zeros((2, 3))
    targets = np.array([[0.5, 0.0, -0.3], [0.1, -0.2, 0.3]])
    for _ in range(200):
        velocities = accelerated(velocities, targets, LIMITS, np.zeros(2), 0.025)

    assert velocities == pytest.approx(targets)


def test_a_robot_that_carries_its_own_mass_accelerates_half_as_fast():
    targets = np.ones((2, 3))
    loads = LIMITS[:, MASS].copy()

    loaded = accelerated(np.zeros((2, 3)), targets, LIMITS, loads, 0.1)

    empty = accelerated(np.zeros((2, 3)), targets, LIMITS, np.zeros(2), 0.1)
    assert loaded == pytest.approx(empty / 2)


def test_steps_along_an_arc_end_where_the_arc_ends():
    pose = np.zeros((1, 3))
    for _ in range(400):
        pose = moved(pose, np.array([[1.0, 0.0, math.pi / 2]]) / 400)

    radius = 2 / math.pi
    assert pose[0] == pytest.approx([radius, radius, math.pi / 2], abs=1e-5)


def test_a_sideways_shift_is_to_the_left_of_the_heading():
    pose = moved(np.array([[1.0, 1.0, math.pi / 2]]), np.array([[0.0, 0.5, 0.0]]))

    assert pose[0] == pytest.approx([0.5, 1.0, math.pi / 2])


def test_wheels_without_grip_turn_and_the_base_stays_to_the_last_bit():
    poses, commands = np.array([[1.1, 2.2, 3.1], [3.3, 4.4, -3.1]]), np.full((2, 3), 0.2)
    obeys, grip = np.array([True, True]), np.array([0.0, 1.0])

    _, shifts, after = driven(
        poses, np.zeros((2, 3)), commands, obeys, LIMITS, np.zeros(2), grip, 0.1
    )

    assert (shifts[:, 0] > 0).all()
    assert after[0].tobytes() == poses[0].tobytes()
    assert after[1, 0] != poses[1, 0]


def test_a_base_that_does_not_obey_brakes():
    rolling, commands = np.full((2, 3), 0.3), np.full((2, 3), 0.3)
    obeys, load = np.array([False, True]), np.zeros(2)

    velocities, _, _ = driven(
        np.zeros((2, 3)), rolling, commands, obeys, LIMITS, load, np.ones(2), 0.01
    )

    assert 0 < velocities[0, 0] < 0.3
    assert velocities[1] == pytest.approx(rolling[1])
