# SPDX-License-Identifier: BSD-3-Clause
"""Positions in the plane."""

import math

import pytest

from hive_common.pose import Pose


def test_the_distance_is_straight_and_ignores_headings():
    assert Pose(1.0, 1.0, 3.0).distance_to(Pose(4.0, 5.0, -3.0)) == 5.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["x", "y", "yaw"])
def test_a_pose_with_a_number_that_is_nan_or_infinite_is_not_finite(field, bad):
    numbers = {"x": 1.0, "y": 2.0, "yaw": 3.0}

    assert Pose(**numbers).is_finite
    assert not Pose(**{**numbers, field: bad}).is_finite


def test_a_pose_prints_two_decimals():
    assert str(Pose(1.0, -2.345, 1.0)) == "(1.00, -2.35)"
