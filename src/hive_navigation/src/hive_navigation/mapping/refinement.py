# SPDX-License-Identifier: BSD-3-Clause
"""Matches all scans of a mapping run to each other at once, after the run.

During the run each scan is matched to the map so far and then stays where it is. Where few walls
are visible, a part of the hall comes out turned by half a degree, and later scans of it match less
and less. After the run all poses are optimized together: every scan is pulled to every other one
taken nearby, across the surfaces, and the odometry relates each pose to the one before (Lu and
Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4,
1997). This needs no loop detection: when a robot returns to a place, its scans lie near those that
it took there before.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse, spatial
from scipy.sparse import linalg

from hive_common.pose import Pose, between
from hive_navigation.mapping.scan_matcher import NOISE, OUTLIER

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapping.surfaces import Surface

APART = 2.0  # sightings made farther from each other than this are not matched [m]

NEAREST = (0.3, 0.3, 0.2, 0.2, 0.1)
"""Points farther than this from the other sighting's surfaces are ignored [m], in the first rounds
and all others."""

ALIGNED = 0.7
"""Least cosine between the normals of one surface in two sightings: the other side of a thin wall
faces the other way."""

MAX_ROUNDS = 20  # number of rounds in which all poses are optimized
STILL = 2e-4  # a round in which no pose moves farther is the last one [m, rad]

DRIFT = (0.02, 0.02)
"""Standard deviations of the odometry after 1 m or 1 rad [m], [rad]; they grow in proportion."""

FIXED = 1e-6  # standard deviation of the first pose, which stays where it is [m, rad]
MAX_POINTS = 150  # number of evenly spread points of a sighting that are matched


@dataclass(frozen=True)
class Sighting:
    """What a robot saw around one place."""

    odometry: Pose  # the robot's pose by odometry, frame odom
    pose: Pose  # the mapper's estimate of it, frame map
    surface: Surface | None  # what the robot saw, relative to that pose; None if it saw too little


def refined(sightings: Sequence[Sighting]) -> list[Pose]:
    """Return the optimized poses of sightings in their order, frame map; the first one stays."""
    poses = np.array([each.pose for each in sightings])
    shown = {i: each.surface for i, each in enumerate(sightings) if each.surface is not None}
    for turn in range(MAX_ROUNDS):
        system = _System(len(poses))
        system.fix(0, np.array(sightings[0].pose) - poses[0])
        _relate_by_odometry(system, sightings, poses)
        reach = NEAREST[min(turn, len(NEAREST) - 1)]
        for one, others in _neighbours(shown, poses):
            _relate_by_surfaces(system, shown, poses, one, others, reach)
        move = system.solved()
        poses += move
        if turn >= len(NEAREST) and np.abs(move).max() < STILL:
            break
    return [Pose(x, y, math.remainder(yaw, math.tau)) for x, y, yaw in poses.tolist()]


def _neighbours(shown: Mapping[int, Surface], poses: Array) -> Iterator[tuple[int, Indices]]:
    """Yield each sighting with a surface, and the others that were made near it."""
    rows = np.array(list(shown), dtype=np.intp)
    places = poses[rows, :2]
    found = spatial.cKDTree(places).query_ball_point(places, APART)
    for one, near in zip(rows.tolist(), found, strict=True):
        others = np.sort(rows[near])
        others = others[others != one]
        if len(others):
            yield one, others


class _System:
    """Weighted normal equations for small moves of n poses."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._rows: list[Indices] = []
        self._columns: list[Indices] = []
        self._values: list[Array] = []
        self._right = np.zeros(3 * number)

    def add(self, poses: Sequence[int], matrix: Array, right: Array) -> None:
        """Add normal equations (3m, 3m) of m poses, and their right side (3m,)."""
        where = (3 * np.array(poses)[:, None] + np.arange(3)).ravel()
        self._rows.append(where.repeat(len(where)))
        self._columns.append(np.tile(where, len(where)))
        self._values.append(matrix.ravel())
        self._right[where] += right

    def fix(self, pose: int, off: Array) -> None:
        """Fix a pose that must move by `off` (3,)."""
        self.add([pose], np.eye(3) / FIXED**2, off / FIXED**2)

    def solved(self) -> Array:
        """Return the moves (n, 3) that solve the equations."""
        size = 3 * self._number
        places = np.concatenate(self._rows), np.concatenate(self._columns)
        matrix = sparse.coo_matrix((np.concatenate(self._values), places), shape=(size, size))
        move: Array = linalg.spsolve(matrix.tocsc(), self._right)
        return move.reshape(-1, 3)


def _relate_by_odometry(system: _System, sightings: Sequence[Sighting], poses: Array) -> None:
    """Relate each pose to the one before by the odometry between them."""
    for first, (a, b) in enumerate(itertools.pairwise(sightings)):
        step = between(a.odometry, b.odometry)
        cos, sin = math.cos(poses[first, 2]), math.sin(poses[first, 2])
        reach = np.array([cos * step.x - sin * step.y, sin * step.x + cos * step.y])
        off = poses[first + 1] - poses[first] - [*reach, step.yaw]
        off[2] = math.remainder(off[2], math.tau)
        distance = math.hypot(step.x, step.y) + abs(step.yaw) + FIXED
        weights = 1.0 / (distance * np.array([DRIFT[0], DRIFT[0], DRIFT[1]]) ** 2)
        slopes = np.hstack([-np.eye(3), np.eye(3)])
        slopes[:2, 2] = reach[1], -reach[0]
        weighed = slopes.T * weights
        system.add([first, first + 1], weighed @ slopes, -(weighed @ off))


def _relate_by_surfaces(
    system: _System,
    shown: Mapping[int, Surface],
    poses: Array,
    one: int,
    others: Indices,
    reach: float,
) -> None:
    """Pull the sightings `others` (k,) to the surfaces of one, if within `reach` [m] of them."""
    known, (x, y, yaw) = shown[one], poses[one]
    pieces = [_thinned(shown[other]) for other in others.tolist()]
    owners = np.arange(len(others)).repeat([len(points) for points, _ in pieces])
    points, theirs = (np.concatenate(each) for each in zip(*pieces, strict=True))
    headings = poses[others[owners], 2]
    arms = _rotated(points, headings)
    away = arms + poses[others[owners], :2] - (x, y)
    apart, nearest = known.tree.query(_rotated(away, -yaw), distance_upper_bound=reach)
    near = np.isfinite(apart).nonzero()[0]
    normals = _rotated(known.normals[nearest[near]], yaw)
    same = (normals * _rotated(theirs[near], headings[near])).sum(axis=1) >= ALIGNED
    near, normals = near[same], normals[same]
    arms, away, owners, nearest = arms[near], away[near], owners[near], nearest[near]
    off = ((away - _rotated(known.points[nearest], yaw)) * normals).sum(axis=1)
    weights = known.flatness[nearest] / (1 + (off / OUTLIER) ** 2) / NOISE**2
    slopes = np.column_stack([-normals, -_cross(away, normals), normals, _cross(arms, normals)])
    weighed = slopes * weights[:, None]
    ends = np.searchsorted(owners, np.arange(len(others) + 1)).tolist()
    for other, (first, last) in zip(others.tolist(), itertools.pairwise(ends), strict=True):
        if last > first:
            here = weighed[first:last]
            system.add([one, other], here.T @ slopes[first:last], -(here.T @ off[first:last]))


def _thinned(surface: Surface) -> tuple[Array, Array]:
    """Return evenly spread points (k, 2) of a surface, and their normals (k, 2)."""
    every = max(1, math.ceil(len(surface.points) / MAX_POINTS))
    return surface.points[::every], surface.normals[::every]


def _rotated(points: Array, angles: Array | float) -> Array:
    """Return points (k, 2) rotated by angles [rad] around the origin."""
    cos, sin = np.cos(angles), np.sin(angles)
    x, y = points.T
    return np.column_stack([cos * x - sin * y, sin * x + cos * y])


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products (k,) of vectors (k, 2)."""
    product: Array = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product
