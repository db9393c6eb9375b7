# SPDX-License-Identifier: BSD-3-Clause
"""Positions in the plane."""

import math

import pytest

from hive_common.pose import Pose


def test_the_distance_is_as_the_crow_flies_and_does_not_look_at_headings():
    assert Pose(1.0, 1.0, 3.0).distance_to(Pose(4.0, 5.0, -3.0)) == 5.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("field", ["x", "y", "yaw"])
def test_a_pose_with_one_number_that_is_none_is_not_finite(field, bad):
    numbers = {"x": 1.0, "y": 2.0, "yaw": 3.0}

    assert Pose(**numbers).is_finite
    assert not Pose(**{**numbers, field: bad}).is_finite


def test_a_pose_is_written_with_two_digits():
    assert str(Pose(1.0, -2.345, 1.0)) == "(1.00, -2.35)"
