# SPDX-License-Identifier: BSD-3-Clause
"""Positions in the plane."""

import math

import pytest

from hive_common.pose import FARTHEST, Pose


def test_the_distance_is_straight_and_ignores_headings():
    assert Pose(1.0, 1.0, 3.0).distance_to(Pose(4.0, 5.0, -3.0)) == 5.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["x", "y", "yaw"])
def test_a_pose_with_a_number_that_is_nan_or_infinite_is_not_finite(field, bad):
    numbers = {"x": 1.0, "y": 2.0, "yaw": 3.0}

    assert Pose(**numbers).is_finite
    assert not Pose(**{**numbers, field: bad}).is_finite


@pytest.mark.parametrize(
    ("pose", "flaw"),
    [
        (Pose(FARTHEST, -FARTHEST, 3.0), ""),
        (Pose(math.nan, 0.0), "is not made of finite numbers"),
        (Pose(1e308, 0.0), "is farther from the origin than 100 km"),
        (Pose(0.0, -100_001.0), "is farther from the origin than 100 km"),
        (Pose(0.0, 0.0, 1e300), "has a heading of more than 1000 rad"),
    ],
)
def test_a_pose_says_why_one_cannot_calculate_with_it(pose, flaw):
    assert pose.flaw == flaw


def test_a_pose_prints_two_decimals():
    assert str(Pose(1.0, -2.345, 1.0)) == "(1.00, -2.35)"
