# SPDX-License-Identifier: BSD-3-Clause
"""Refining a map corrects the drift of a run."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from shapely.geometry import box

from hive_common.pose import Pose, between, compose, inverse
from hive_navigation.mapping.refinement import Sighting, refined
from hive_navigation.mapping.surfaces import Surface, Surfaces
from robot_description.models import load_model
from simenv.sensors.laser import Scanner
from simenv.testing import hall
from simenv.world.shapes import Shape

LASER = load_model("ld60").laser
POSTS = [(1.2, 4.1), (2.1, 8.8), (5.4, 9.0), (8.9, 6.3), (7.8, 1.1), (3.3, 0.9), (0.9, 6.9)]
WORLD = hall(
    Shape("table", box(4.2, 3.8, 5.8, 6.1)),
    *(Shape(f"post {x}", box(x, y, x + 0.3, y + 0.3)) for x, y in POSTS),
)
LOOP = 28


def round_the_table() -> list[Pose]:
    """Return where a robot stands on its way round the table, counter-clockwise, and a bit on."""
    angles = [math.tau * i / (LOOP - 3) for i in range(LOOP)]
    return [Pose(5 + 3 * math.cos(a), 5 + 3 * math.sin(a), a + math.pi / 2) for a in angles]


def seen_from(pose: Pose) -> Surface | None:
    scanner = Scanner(LASER, 0.01, np.random.default_rng(int(1000 * pose.yaw)))
    ranges = scanner.measure(pose, WORLD.segments)
    hit = (ranges > 0) & np.isfinite(ranges)
    reach, angles = ranges[hit], scanner.angles[hit]
    surfaces = Surfaces(0.05)
    surfaces.add(np.column_stack([reach * np.cos(angles), reach * np.sin(angles)]), (0.0, 0.0))
    return surfaces.around(0.0, 0.0, math.inf)


def bent(poses: list[Pose], each: Pose) -> list[Pose]:
    """Return poses of which each one is off by the same against the one before."""
    found = [poses[0]]
    for before, after in itertools.pairwise(poses):
        found.append(compose(compose(found[-1], between(before, after)), each))
    return found


def farthest(poses: list[Pose], truth: list[Pose]) -> float:
    return max(math.dist(a[:2], b[:2]) for a, b in zip(poses, truth, strict=True))


def test_a_drift_in_every_pose_is_corrected() -> None:
    truth = round_the_table()
    wrong = bent(truth, Pose(0.003, 0.0, 0.004))

    found = refined(
        [Sighting(pose, pose, seen_from(there)) for pose, there in zip(wrong, truth, strict=True)]
    )

    assert farthest(wrong, truth) > 0.15
    assert farthest(found, truth) < 0.03
    assert found[0] == pytest.approx(truth[0], abs=1e-4)


def test_without_surfaces_the_odometry_determines_the_poses() -> None:
    truth = round_the_table()[:6]
    odometry = [compose(inverse(truth[0]), pose) for pose in truth]
    wrong = bent(truth, Pose(0.01, 0.0, 0.02))

    found = refined(
        [Sighting(wheels, pose, None) for wheels, pose in zip(odometry, wrong, strict=True)]
    )

    assert farthest(found, truth) < 1e-3
