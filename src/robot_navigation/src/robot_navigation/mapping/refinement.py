# SPDX-License-Identifier: BSD-3-Clause
"""Fits all scans of a mapping run to each other at once, when the run is over.

While a robot maps, each scan is fitted to what was known until then, and stays where it was put
down. Where few walls were in sight, a part of the hall comes out turned by half a degree, and what
is seen of it later from elsewhere fits less and less. At the end everything is known, so all poses
can be sought that fit best together: every scan is drawn to every other one that was taken near
it, across the surfaces, and the odometry says how one pose follows from the one before (Lu and
Milios, "Globally consistent range scan alignment for environment mapping", Autonomous Robots 4,
1997). No loop has to be recognized for that: where a robot comes back to a place, its scans lie
near those that it took there before.
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
from robot_navigation.mapping.scan_matcher import NOISE, OUTLIER

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from hive_common.geometry import Array, Indices
    from robot_navigation.mapping.surfaces import Surface

APART = 2.0
"""Sightings are fitted to each other that were made no farther from each other [m]."""

NEAREST = (0.3, 0.3, 0.2, 0.2, 0.1)
"""What lies farther from anything of the other sighting is something else [m], in the first rounds
and in all that follow."""

ALIGNED = 0.7
"""Two surfaces are the same only if the cosine of the angle between them is at least this: the
other side of a thin wall faces the other way."""

ROUNDS = 20
"""So often all poses are sought anew, at most."""

STILL = 2e-4
"""A round in which no pose moves farther is the last one [m, rad]."""

DRIFT = (0.02, 0.02)
"""How far the odometry is off after 1 m or 1 rad, as standard deviations [m] and [rad]; it grows
with the square root of the way."""

FIXED = 1e-6
"""The first pose stays where it is, to so much [m, rad]."""

POINTS = 150
"""So many points of a sighting are fitted to the others, spread evenly."""


@dataclass(frozen=True)
class Sighting:
    """What a robot saw around one place.

    Attributes:
        odometry: Where the wheels had the robot then, frame odom.
        pose: Where the mapper had it, frame map.
        surface: What it saw, seen from that pose; None if that was next to nothing.
    """

    odometry: Pose
    pose: Pose
    surface: Surface | None


def refined(sightings: Sequence[Sighting]) -> list[Pose]:
    """Return where the robot was at each sighting, frame map; the first one is where it was.

    Args:
        sightings: In the order in which they were made.
    """
    poses = np.array([each.pose for each in sightings])
    shown = {i: each.surface for i, each in enumerate(sightings) if each.surface is not None}
    for turn in range(ROUNDS):
        system = _System(len(poses))
        system.fix(0, np.array(sightings[0].pose) - poses[0])
        _follow(system, sightings, poses)
        reach = NEAREST[min(turn, len(NEAREST) - 1)]
        for one, others in _neighbours(shown, poses):
            _draw(system, shown, poses, one, others, reach)
        move = system.solved()
        poses += move
        if turn >= len(NEAREST) and np.abs(move).max() < STILL:
            break
    return [Pose(x, y, math.remainder(yaw, math.tau)) for x, y, yaw in poses.tolist()]


def _neighbours(shown: Mapping[int, Surface], poses: Array) -> Iterator[tuple[int, Indices]]:
    """Yield each sighting that shows something, and those others that were made near it."""
    rows = np.array(list(shown), dtype=np.intp)
    places = poses[rows, :2]
    found = spatial.cKDTree(places).query_ball_point(places, APART)
    for one, near in zip(rows.tolist(), found, strict=True):
        others = np.sort(rows[near])
        others = others[others != one]
        if len(others):
            yield one, others


class _System:
    """Linear equations for small moves of n poses, and how much each of them counts."""

    def __init__(self, number: int) -> None:
        self._number = number
        self._rows: list[Indices] = []
        self._columns: list[Indices] = []
        self._values: list[Array] = []
        self._right = np.zeros(3 * number)

    def add(self, poses: Sequence[int], matrix: Array, right: Array) -> None:
        """Take in normal equations (3m, 3m) of m poses, and their right side (3m,)."""
        where = (3 * np.array(poses)[:, None] + np.arange(3)).ravel()
        self._rows.append(where.repeat(len(where)))
        self._columns.append(np.tile(where, len(where)))
        self._values.append(matrix.ravel())
        self._right[where] += right

    def fix(self, pose: int, off: Array) -> None:
        """Have a pose be where it is to be, from which it is `off` (3,)."""
        self.add([pose], np.eye(3) / FIXED**2, off / FIXED**2)

    def solved(self) -> Array:
        """Return the moves (n, 3) that fit best."""
        size = 3 * self._number
        places = np.concatenate(self._rows), np.concatenate(self._columns)
        matrix = sparse.coo_matrix((np.concatenate(self._values), places), shape=(size, size))
        move: Array = linalg.spsolve(matrix.tocsc(), self._right)
        return move.reshape(-1, 3)


def _follow(system: _System, sightings: Sequence[Sighting], poses: Array) -> None:
    """Say how each pose follows from the one before, by the odometry."""
    for first, (a, b) in enumerate(itertools.pairwise(sightings)):
        step = between(a.odometry, b.odometry)
        cos, sin = math.cos(poses[first, 2]), math.sin(poses[first, 2])
        reach = np.array([cos * step.x - sin * step.y, sin * step.x + cos * step.y])
        off = poses[first + 1] - poses[first] - [*reach, step.yaw]
        off[2] = math.remainder(off[2], math.tau)
        way = math.hypot(step.x, step.y) + abs(step.yaw) + FIXED
        weights = 1.0 / (way * np.array([DRIFT[0], DRIFT[0], DRIFT[1]]) ** 2)
        slopes = np.hstack([-np.eye(3), np.eye(3)])
        slopes[:2, 2] = reach[1], -reach[0]
        weighed = slopes.T * weights
        system.add([first, first + 1], weighed @ slopes, -(weighed @ off))


def _draw(
    system: _System,
    shown: Mapping[int, Surface],
    poses: Array,
    one: int,
    others: Indices,
    reach: float,
) -> None:
    """Say how sightings lie on the surfaces of one of them.

    Args:
        system: Where it is said.
        shown: What each sighting shows.
        poses: (n, 3) where they were made, frame map.
        one: The one that has the surfaces.
        others: (k,) those that are to lie on them.
        reach: How far from them they may be [m].
    """
    known, (x, y, yaw) = shown[one], poses[one]
    pieces = [_thinned(shown[other]) for other in others.tolist()]
    owners = np.arange(len(others)).repeat([len(points) for points, _ in pieces])
    points, theirs = (np.concatenate(each) for each in zip(*pieces, strict=True))
    headings = poses[others[owners], 2]
    arms = _turned(points, headings)
    away = arms + poses[others[owners], :2] - (x, y)
    apart, nearest = known.tree.query(_turned(away, -yaw), distance_upper_bound=reach)
    near = np.isfinite(apart).nonzero()[0]
    normals = _turned(known.normals[nearest[near]], yaw)
    same = (normals * _turned(theirs[near], headings[near])).sum(axis=1) >= ALIGNED
    near, normals = near[same], normals[same]
    arms, away, owners, nearest = arms[near], away[near], owners[near], nearest[near]
    off = ((away - _turned(known.points[nearest], yaw)) * normals).sum(axis=1)
    weights = known.flatness[nearest] / (1 + (off / OUTLIER) ** 2) / NOISE**2
    slopes = np.column_stack([-normals, -_cross(away, normals), normals, _cross(arms, normals)])
    weighed = slopes * weights[:, None]
    ends = np.searchsorted(owners, np.arange(len(others) + 1)).tolist()
    for other, (first, last) in zip(others.tolist(), itertools.pairwise(ends), strict=True):
        if last > first:
            here = weighed[first:last]
            system.add([one, other], here.T @ slopes[first:last], -(here.T @ off[first:last]))


def _thinned(surface: Surface) -> tuple[Array, Array]:
    """Return some points (k, 2) of a surface, spread evenly, and their normals (k, 2)."""
    every = max(1, math.ceil(len(surface.points) / POINTS))
    return surface.points[::every], surface.normals[::every]


def _turned(points: Array, angles: Array | float) -> Array:
    """Return points (k, 2) turned by angles [rad] around the origin."""
    cos, sin = np.cos(angles), np.sin(angles)
    x, y = points.T
    return np.column_stack([cos * x - sin * y, sin * x + cos * y])


def _cross(a: Array, b: Array) -> Array:
    """Return the cross products (k,) of vectors (k, 2)."""
    product: Array = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product
