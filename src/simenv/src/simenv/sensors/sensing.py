# SPDX-License-Identifier: BSD-3-Clause
"""The laser scanners of all robots: any number of scans in one go."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose
from simenv.sensors.beams import cast

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array
    from simenv.bodies.footprints import Footprints
    from simenv.sensors.laser import Scanner
    from simenv.world.surroundings import Surroundings


def take_scans(
    scanners: Sequence[Scanner],
    rows: Sequence[int],
    poses: Array,
    footprints: Footprints,
    surroundings: Surroundings,
) -> list[Array]:
    """Take a scan with each of m scanners; they see walls, obstacles, and the other robots.

    Args:
        scanners: The scanners.
        rows: On which robot each is mounted, a row of `poses`.
        poses: (n, 3) where all robots are, frame map [m, m, rad].
        footprints: Of all robots.
        surroundings: What else there is.

    Returns:
        For each scanner: (beams,) distances [m], see `Scanner.read`.
    """
    where = zip(scanners, poses[list(rows)].tolist(), strict=True)
    origins = np.array([scanner.origin(Pose(*pose)) for scanner, pose in where])
    reaches = np.array([scanner.reach for scanner in scanners])
    segments, owners, _ = surroundings.near(origins, reaches)
    x, y = (origins[:, None, :2] - poses[:, :2]).transpose(2, 0, 1)
    near = np.hypot(x, y) <= reaches[:, None] + footprints.radii
    near[np.arange(len(rows)), rows] = False
    who, others = near.nonzero()
    if len(who):
        edges = footprints.outlines(others, poses[others]).reshape(-1, 2, 2)
        segments = np.concatenate([segments, edges])
        owners = np.concatenate([owners, who.repeat(footprints.corners)])
    distances, starts = cast([scanner.fan for scanner in scanners], origins, segments, owners)
    ends = itertools.pairwise(starts)
    return [
        scanner.read(distances[first:last])
        for scanner, (first, last) in zip(scanners, ends, strict=True)
    ]
