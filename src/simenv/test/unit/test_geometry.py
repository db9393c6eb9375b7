# SPDX-License-Identifier: BSD-3-Clause
import math

import numpy as np
import pytest
from shapely.geometry import LineString, Polygon

from robot_description.follower import Pose
from robot_description.poses import compose
from simenv.geometry import Footprint, Nearby, outline, ranges

SQUARE = np.array([[2.0, -1.0], [4.0, -1.0], [4.0, 1.0], [2.0, 1.0]])


def test_a_beam_reaches_to_the_near_side_of_what_it_hits():
    reach = ranges(Pose(0.0, 0.0, 0.0), np.array([0.0]), outline(SQUARE))

    assert reach == pytest.approx([2.0])


def test_beams_turn_with_their_origin():
    angles = np.array([0.0, math.pi / 2])

    reach = ranges(Pose(3.0, 5.0, -math.pi / 2), angles, outline(SQUARE))

    assert reach == pytest.approx([4.0, math.inf])


def test_a_beam_without_anything_to_hit_goes_on_for_ever():
    assert ranges(Pose(0, 0, 0), np.zeros(3), np.empty((0, 2, 2))).tolist() == [math.inf] * 3


def test_no_beam_slips_through_a_corner():
    angles = np.linspace(-math.pi, math.pi, 9)[:-1]
    inside_out = outline(SQUARE[::-1])

    reach = ranges(Pose(3.0, 0.0, 0.0), angles, inside_out)

    assert reach == pytest.approx([1.0, math.sqrt(2)] * 4)


def test_beams_agree_with_shapely():
    random = np.random.default_rng(3)
    triangle = np.array([[3.0, 1.0], [4.0, 3.0], [1.5, 2.5]])
    solid = [Polygon(SQUARE), Polygon(triangle)]
    segments = np.concatenate([outline(SQUARE), outline(triangle)])
    angles = random.uniform(-math.pi, math.pi, 200)

    reach = ranges(Pose(0.5, 0.2, 0.3), angles, segments)

    for angle, distance in zip(angles, reach, strict=True):
        heading = angle + 0.3
        tip = (0.5 + 50 * math.cos(heading), 0.2 + 50 * math.sin(heading))
        beam = LineString([(0.5, 0.2), tip])
        hits = [beam.intersection(area) for area in solid if beam.intersects(area)]
        expected = min(
            (math.dist((0.5, 0.2), min(hit.coords, key=_from_start)) for hit in hits),
            default=math.inf,
        )
        assert distance == pytest.approx(expected)


def _from_start(point):
    return math.dist((0.5, 0.2), point)


def test_a_footprint_touches_what_passes_through_it_wherever_it_stands():
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


def test_everything_within_reach_of_a_place_is_found_and_far_things_are_not():
    random = np.random.default_rng(5)
    start = random.uniform(0, 50, (400, 1, 2))
    segments = np.concatenate([start, start + random.uniform(-1, 1, (400, 1, 2))], axis=1)
    near = Nearby(segments)
    x, y = 20.3, 31.8

    found = near.at(x, y, 3.0)

    kept = {segment.tobytes() for segment in found}
    for segment in segments:
        if LineString(segment).distance(LineString([(x, y), (x, y)])) <= 3.0:
            assert segment.tobytes() in kept
    assert 0 < len(found) < 40


def test_a_mounted_thing_turns_with_what_carries_it():
    laser = compose(Pose(1.0, 2.0, math.pi / 2), Pose(0.5, 0.1, math.pi))

    assert laser == pytest.approx((0.9, 2.5, -math.pi / 2))
