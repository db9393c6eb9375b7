# SPDX-License-Identifier: BSD-3-Clause
import itertools
import math

import numpy as np
import pytest
from shapely.geometry import LineString, Polygon

from hive_common.geometry import Footprint, outline
from hive_common.pose import Pose
from simenv.sensors.beams import Fan, Fans, cast

SQUARE = np.array([[2.0, -1.0], [4.0, -1.0], [4.0, 1.0], [2.0, 1.0]])
ROUND = Fan(-math.pi, math.tau / 720, 720)


NOBODY = (np.zeros((0, 3)), np.zeros((0, 4, 2)), np.zeros(0), np.full(4, 9.0))


def seen(fans, origins, segments, firsts, robots=NOBODY):
    """Return what each of some scanners sees of the segments from its first one on."""
    table = Fans(fans)
    starts = np.cumsum([0, *(fan.number for fan in fans)])
    reach = cast(
        np.array(origins, dtype=float),
        np.arange(len(fans)),
        starts,
        table.spreads,
        table.places,
        table.directions,
        np.ascontiguousarray(segments),
        np.array(firsts),
        *robots,
    )
    return [reach[a:b] for a, b in itertools.pairwise(starts)]


def ranges(origin, fan, segments):
    return seen([fan], [origin], segments, [0, len(segments)])[0]


def test_a_beam_reaches_to_the_near_side_of_what_it_hits():
    reach = ranges(Pose(0.0, 0.0, 0.0), Fan(0.0, 0.1, 1), outline(SQUARE))

    assert reach == pytest.approx([2.0])


def test_beams_turn_with_their_origin():
    ahead_and_left = Fan(0.0, math.pi / 2, 2)

    reach = ranges(Pose(3.0, 5.0, -math.pi / 2), ahead_and_left, outline(SQUARE))

    assert reach == pytest.approx([4.0, math.inf])


def test_a_beam_without_anything_to_hit_goes_on_for_ever():
    assert ranges(Pose(0, 0, 0), ROUND, np.empty((0, 2, 2))).tolist() == [math.inf] * 720


def test_no_beam_slips_through_a_corner():
    into_the_corners = Fan(-math.pi, math.pi / 4, 8)
    inside_out = outline(SQUARE[::-1])

    reach = ranges(Pose(3.0, 0.0, 0.0), into_the_corners, inside_out)

    assert reach == pytest.approx([1.0, math.sqrt(2)] * 4)


def test_beams_agree_with_shapely():
    random = np.random.default_rng(3)
    triangle = np.array([[3.0, 1.0], [4.0, 3.0], [1.5, 2.5]])
    solid = [Polygon(SQUARE), Polygon(triangle)]
    segments = np.concatenate([outline(SQUARE), outline(triangle)])
    fan = Fan(-3.0, 0.03 + random.uniform(0.0, 0.001), 200)

    reach = ranges(Pose(0.5, 0.2, 0.3), fan, segments)

    for angle, distance in zip(fan.angles, reach, strict=True):
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


def by_the_formula(fan, origin, segments):
    """Try every beam with every segment."""
    heading = fan.angles[:, None] + origin[2]
    dx, dy = np.cos(heading), np.sin(heading)
    (ax, ay), (ex, ey) = (segments[:, 0] - origin[:2]).T, (segments[:, 1] - segments[:, 0]).T
    cross = dx * ey - dy * ex
    reach, along = (ax * ey - ay * ex) / cross, (ax * dy - ay * dx) / cross
    hits = (reach > 0) & (along >= 0) & (along <= 1) & (ax * ey - ay * ex < 0)
    return np.where(hits, reach, np.inf).min(axis=1, initial=np.inf)


def test_many_scanners_at_once_see_what_each_would_see_alone():
    random = np.random.default_rng(9)
    fans = [ROUND, Fan(-2.0, 4.0 / 541, 541), Fan(0.5, 0.01, 300), ROUND]
    origins = np.column_stack([random.uniform(-1, 1, (4, 2)), random.uniform(-4, 4, 4)])
    squares = [outline(SQUARE * 0.3 + random.uniform(-6, 6, 2)) for _ in range(40)]
    segments = np.concatenate(squares)
    everywhere = np.tile(segments, (3, 1, 1))  # the third scanner has nothing near it
    firsts = np.array([0, 1, 2, 2, 3]) * len(segments)

    reach = seen(fans, origins, everywhere, firsts)

    for scanner in (0, 1, 3):
        expected = by_the_formula(fans[scanner], origins[scanner], segments)
        alone = ranges(origins[scanner], fans[scanner], segments)
        assert np.array_equal(np.isinf(reach[scanner]), np.isinf(expected))
        assert reach[scanner] == pytest.approx(expected)
        assert reach[scanner].tobytes() == alone.tobytes()
    assert np.isinf(reach[2]).all()


def test_other_robots_are_seen_as_their_outlines_are_and_only_within_reach():
    random = np.random.default_rng(4)
    poses = random.uniform((-5, -5, -4), (5, 5, 4), (30, 3))
    fans, origins = [ROUND, Fan(-2.0, 4.0 / 541, 541)], poses[:2]
    near = np.hypot(*(poses[:, None, :2] - origins[:, :2]).T) <= 3.5 + 0.5
    near[[0, 1], [0, 1]] = False
    points = np.tile(SQUARE * [0.2, 0.3] - [0.6, 0.0], (30, 1, 1))
    outlines = [outline(Footprint(points[0]).at(Pose(*pose))) for pose in poses]

    taken = seen(
        fans, origins, np.empty((0, 2, 2)), [0, 0, 0],
        (poses, points, np.full(30, 0.5), np.full(30, 3.5)),
    )  # fmt: skip

    for scanner in (0, 1):
        edges = np.concatenate([outlines[other] for other in near[scanner].nonzero()[0]])
        expected = by_the_formula(fans[scanner], origins[scanner], edges)
        assert np.isfinite(expected).sum() > 40
        assert np.array_equal(np.isinf(taken[scanner]), np.isinf(expected))
        assert taken[scanner] == pytest.approx(expected)


def test_a_segment_behind_a_scanner_that_looks_ahead_is_not_seen_at_its_edges():
    ahead = Fan(-1.0, 0.5, 5)
    behind = outline(SQUARE * [-1, 1])[::-1, ::-1]

    assert np.isinf(ranges(Pose(0.0, 0.0, 0.0), ahead, behind)).all()
