# SPDX-License-Identifier: BSD-3-Clause
import math

import numpy as np
import pytest
from shapely.geometry import LineString, Polygon

from hive_common.geometry import Footprint
from hive_common.pose import Pose, compose


def test_a_footprint_touches_segments_that_pass_through_it_at_any_pose():
    random = np.random.default_rng(4)
    footprint = Footprint([[-0.4, -0.3], [0.4, -0.3], [0.5, 0.0], [0.4, 0.3], [-0.4, 0.3]])
    answers = set()
    for _ in range(300):
        pose = Pose(*random.uniform(-1, 1, 2), random.uniform(-3, 3))
        segment = random.uniform(-1.5, 1.5, (1, 2, 2))

        touching = footprint.touches(pose, segment)

        assert touching == LineString(segment[0]).intersects(Polygon(footprint.at(pose)))
        answers.add(touching)

    assert answers == {True, False}


def test_a_segment_along_an_edge_does_not_touch_until_the_margin_reaches_it():
    footprint = Footprint([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    wall = np.array([[[1.5, -2.0], [1.5, 2.0]]])
    beside = Pose(1.0, 0.0, 0.0)

    assert not footprint.touches(beside, wall)
    assert footprint.touches(beside, wall, margin=0.01)
    assert footprint.touches(Pose(1.001, 0.0, 0.0), wall)


def test_a_segment_inside_a_footprint_touches_it():
    footprint = Footprint([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])

    assert footprint.touches(Pose(0, 0, 0), np.array([[[0.1, 0.1], [0.2, 0.2]]]))


def test_a_mounted_laser_turns_with_its_robot():
    laser = compose(Pose(1.0, 2.0, math.pi / 2), Pose(0.5, 0.1, math.pi))

    assert laser == pytest.approx((0.9, 2.5, -math.pi / 2))
