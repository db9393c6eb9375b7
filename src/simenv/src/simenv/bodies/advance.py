# SPDX-License-Identifier: BSD-3-Clause
"""How far robots can go in a step until something stops them.

In most steps most robots run into nothing, wherever the others go in the step. These move at once.
The remaining robots move one after the other, each as far as it can among those that moved before.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices

    Shapes: TypeAlias = tuple[Array, Array, Array]  # points, lines and radii of `Footprints`
    Around: TypeAlias = tuple[Array, Indices, Indices]  # the fields of `Near`, for each robot

CLOSE = 1 / 64  # a step that is cut short ends before the contact, within this share of its length


@compiled()
def _crosses(lines: Array, margin: float, ax: float, ay: float, bx: float, by: float) -> bool:
    """Return whether a segment a-b crosses a convex polygon (Cyrus and Beck's clipping, 1978).

    A segment along an edge does not. `lines` (corners, 3) are those of `Footprints`, moved
    outwards by `margin` [m]; the segment is in the frame of the footprint [m].
    """
    enter, leave = 0.0, 1.0
    for k in range(len(lines)):
        start = lines[k, 0] * ax + lines[k, 1] * ay - lines[k, 2] - margin
        end = lines[k, 0] * bx + lines[k, 1] * by - lines[k, 2] - margin
        if start >= 0 and end >= 0:
            return False
        if start > end:
            enter = max(enter, start / (start - end))
        elif end > start:
            leave = min(leave, start / (start - end))
    return enter < leave


@compiled()
def _touches(
    row: int,
    pose: Array,
    poses: Array,
    margins: Array,
    shapes: Shapes,
    around: Around,
    touched: NDArray[np.bool_],
) -> bool:
    """Return whether a robot touches something at a pose, and mark in `touched` what.

    Args:
        row: The robot.
        pose: (3,) frame map.
        poses: (n, 3) where the other robots are.
        margins: (n,) by how much the robot counts as larger against each other robot; that of its
            own row holds against everything else [m].
        shapes: Of all robots.
        around: What is near each robot.
        touched: One for each thing; the robots are the last n. Updated.
    """
    points, lines, radii = shapes
    segments, things, starts = around
    touched[:] = False
    found = False
    x, y, cos, sin = pose[0], pose[1], math.cos(pose[2]), math.sin(pose[2])
    for k in range(starts[row], starts[row + 1]):
        ax, ay = segments[k, 0, 0] - x, segments[k, 0, 1] - y
        bx, by = segments[k, 1, 0] - x, segments[k, 1, 1] - y
        ax, ay = cos * ax + sin * ay, cos * ay - sin * ax
        bx, by = cos * bx + sin * by, cos * by - sin * bx
        if _crosses(lines[row], margins[row], ax, ay, bx, by):
            found = touched[things[k]] = True
    for other in range(len(poses)):
        dx, dy = poses[other, 0] - x, poses[other, 1] - y
        reach = radii[row] + radii[other] + margins[other]
        if other == row or dx * dx + dy * dy > reach * reach:
            continue
        ahead, left = cos * dx + sin * dy, cos * dy - sin * dx
        turned = poses[other, 2] - pose[2]
        cos_turned, sin_turned = math.cos(turned), math.sin(turned)
        bx = by = 0.0
        for corner in range(-1, points.shape[1]):
            px, py = points[other, corner, 0], points[other, corner, 1]
            ax, ay = bx, by
            bx = ahead + cos_turned * px - sin_turned * py
            by = left + sin_turned * px + cos_turned * py
            if corner >= 0 and _crosses(lines[row], margins[other], ax, ay, bx, by):
                found = touched[len(touched) - len(poses) + other] = True
                break
    return found


@compiled()
def _between(start: Array, end: Array, share: float) -> Array:
    """Return the pose at a share of the way; the yaw takes the shorter turn."""
    way = end - start
    way[2] -= 2 * math.pi * math.floor(way[2] / (2 * math.pi) + 0.5)
    return start + share * way


@compiled()
def _held(
    poses: Array,
    ahead: Array,
    swings: Array,
    shapes: Shapes,
    around: Around,
    touched: NDArray[np.bool_],
) -> Indices:
    """Return (k,) which robots may touch something in a step; the others surely do not.

    Every other robot may be anywhere in its step, so against it the first counts as larger by its
    swing. See `advance` for the arguments.
    """
    margins = swings.copy()
    is_held = np.zeros(len(poses), dtype=np.bool_)
    for i in range(len(poses)):
        if swings[i] > 0:
            margins[i] = 0.0
            is_held[i] = _touches(i, ahead[i], poses, margins, shapes, around, touched)
            margins[i] = swings[i]
    return is_held.nonzero()[0]


@compiled()
def _free(
    row: int,
    ahead: Array,
    poses: Array,
    margins: Array,
    shapes: Shapes,
    around: Around,
    touched: NDArray[np.bool_],
) -> float:
    """Return what share of the way to `ahead` a robot can go, with all robots at `poses`.

    See `_touches` for the others; `touched` says what it touches ahead, and then what stops it.
    """
    free, blocked, probe = 0.0, 1.0, CLOSE  # a robot that pushes on gets no farther
    found = np.empty_like(touched)
    while blocked - free > CLOSE:
        pose = _between(poses[row], ahead, probe)
        if _touches(row, pose, poses, margins, shapes, around, found):
            blocked = probe
            touched[:] = found
        else:
            free = probe
        probe = (free + blocked) / 2
    return free


@compiled()
def _with_fresh(pairs: Indices, stops: Indices) -> Indices:
    """Return `pairs` (p, 2) and behind them those of `stops` (k, 2) that are new, once each."""
    every = np.concatenate((pairs, stops))
    count = len(pairs)
    for stop in stops:
        is_fresh = True
        for a, b in every[:count]:
            if (stop[0] == a and stop[1] == b) or (stop[0] == b and stop[1] == a):
                is_fresh = False  # two robots have one contact, whoever moved
        if is_fresh:
            every[count] = stop
            count += 1
    return every[:count]


@compiled(
    "Tuple((float64[:, ::1], float64[::1], int64[:, ::1], boolean[::1]))(float64[:, ::1],"
    " float64[:, ::1], float64[::1], float64[:, :, ::1], float64[:, :, ::1], float64[::1],"
    " float64[:, :, ::1], int64[::1], int64[::1], int64, int64[:, ::1], float64)"
)
def advance(
    poses: Array,
    ahead: Array,
    swings: Array,
    points: Array,
    lines: Array,
    radii: Array,
    segments: Array,
    things: Indices,
    starts: Indices,
    number: int,
    pairs: Indices,
    gap: float,
) -> tuple[Array, Array, Indices, NDArray[np.bool_]]:
    """Move n robots as far as they can go.

    Args:
        poses: (n, 3) where they stand, frame map.
        ahead: (n, 3) where they want to be.
        swings: (n,) how far anything on them goes until there, at most [m].
        points: See `Footprints`.
        lines: See `Footprints`.
        radii: See `Footprints`.
        segments: What is near each robot anywhere in the step, see `Near`.
        things: See `Near`.
        starts: See `Near`.
        number: Of things besides robots; robot i is the thing `number` + i.
        pairs: (p, 2) robots, as things, and what they touched before; -1 is gone.
        gap: A contact that has this much room ends [m].

    Returns:
        Poses (n, 3) after the step; shares (n,) of the step done, 1 where nothing stopped the
        robot; new pairs (k, 2), in ascending order; and which of all p + k pairs touch now.
    """
    # Tuples only in here: numba takes 0.1 ms to look at those that Python gives it.
    shapes, around = (points, lines, radii), (segments, things, starts)
    margins = np.zeros(len(poses))
    touched = np.zeros(number + len(poses), dtype=np.bool_)
    held = _held(poses, ahead, swings, shapes, around, touched)
    reached, shares = ahead.copy(), np.ones(len(poses))
    for i in held:
        reached[i] = poses[i]
    stops = np.empty((len(held) * len(touched), 2), dtype=np.int64)
    count = 0
    for i in held:
        if not _touches(i, ahead[i], reached, margins, shapes, around, touched):
            reached[i] = ahead[i]
            continue
        shares[i] = _free(i, ahead[i], reached, margins, shapes, around, touched)
        reached[i] = _between(poses[i], ahead[i], shares[i])
        for thing in touched.nonzero()[0]:
            stops[count, 0], stops[count, 1] = number + i, thing
            count += 1
    margins[:] = gap
    every = _with_fresh(pairs, stops[:count])
    touching = np.zeros(len(every), dtype=np.bool_)
    for k in range(len(every)):
        robot, thing = every[k, 0] - number, every[k, 1]
        _touches(robot, reached[robot], reached, margins, shapes, around, touched)
        touching[k] = thing >= 0 and touched[thing]
    return reached, shares, every[len(pairs) :], touching
