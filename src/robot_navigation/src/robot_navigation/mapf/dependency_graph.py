# SPDX-License-Identifier: BSD-3-Clause
"""Who passes first wherever two paths come too near: an action dependency graph.

An *action* is one robot's drive from one place of its path to the next. Two actions are in
conflict if the two robots could touch during them. The one that is planned to begin first goes
first: the other does not begin before it has ended. Every dependency leads from an earlier
beginning to a later one, so the graph has no cycle, whatever the times become.

Hoenig et al., Persistent and Robust Execution of MAPF Schedules in Warehouses, IEEE RA-L 4(2),
2019. There a conflict is a common vertex; here it is the distance of two lanes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled
from robot_navigation.mapf.segments import segments_apart

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices


@dataclass(frozen=True)
class Course:
    """One robot's path, and when it is planned to be where.

    Attributes:
        points: (n, 2) array, frame map [m]; the robot stands still at the last one.
        begins: (n,) array, when it leaves each point [s]; for the last one, when it reaches it.
        radius: Of the circle around its footprint [m].
    """

    points: Array
    begins: Array
    radius: float


def dependencies(courses: Sequence[Course], gap: float) -> Indices:
    """Return who waits for whom.

    Args:
        courses: The robots' courses. A robot that stands has one point.
        gap: Distance that must stay between the circles around two footprints [m].

    Returns:
        (k, 4) array of robot, action, other robot, other action, by indices: the robot must not
        begin its action, the drive from that point on, before the other robot has ended its own,
        has reached the next point. The action of the last point is standing there; it never ends
        in this plan. Of several actions of one other robot the last is given.
    """
    if len(courses) < 2:  # noqa: PLR2004  (nobody to wait for)
        return np.empty((0, 4), dtype=np.int64)
    sizes = [len(course.points) for course in courses]
    return _dependencies(
        np.ascontiguousarray(np.vstack([course.points for course in courses]), dtype=np.float64),
        np.concatenate([course.begins for course in courses]).astype(np.float64),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.array([course.radius for course in courses], dtype=np.float64),
        gap,
    )


@compiled("int64(float64[:, ::1], float64[::1], int64, int64, int64, float64, boolean)")
def _last_before(
    points: Array, begins: Array, mine: int, first: int, end: int, apart: float, yields: bool
) -> int:
    """Return the last action from `first` to `end` that goes before `mine` and is in conflict.

    -1 if there is none. Of two that begin at the same time, `mine` is the second if it `yields`.
    """
    last = -1
    for its in range(first, end):
        if begins[its] > begins[mine] or (begins[its] == begins[mine] and not yields):
            break
        after = min(its + 1, end - 1)
        if segments_apart(points[mine], points[mine + 1], points[its], points[after]) < apart:
            last = its
    return last


@compiled("boolean(float64[::1], float64[::1], float64[::1], float64[::1], float64)")
def _boxes_meet(low: Array, high: Array, its_low: Array, its_high: Array, apart: float) -> bool:
    """Return whether two boxes come nearer to each other than `apart` along both axes [m]."""
    return bool(
        low[0] <= its_high[0] + apart
        and high[0] >= its_low[0] - apart
        and low[1] <= its_high[1] + apart
        and high[1] >= its_low[1] - apart
    )


@compiled("int64[:, ::1](float64[:, ::1], float64[::1], int64[::1], float64[::1], float64)")
def _dependencies(
    points: Array, begins: Array, first: Indices, radii: Array, gap: float
) -> Indices:
    """See `dependencies`; course i has the points from `first[i]` to `first[i + 1]`."""
    robots = len(radii)
    low, high = np.empty((robots, 2)), np.empty((robots, 2))
    for robot in range(robots):
        for axis in range(2):
            low[robot, axis] = np.min(points[first[robot] : first[robot + 1], axis])
            high[robot, axis] = np.max(points[first[robot] : first[robot + 1], axis])
    found, count = np.empty((64, 4), dtype=np.int64), 0
    for me in range(robots):
        for other in range(robots):
            apart = radii[me] + radii[other] + gap
            if me == other or not _boxes_meet(low[me], high[me], low[other], high[other], apart):
                continue
            for mine in range(first[me], first[me + 1] - 1):
                last = _last_before(
                    points, begins, mine, first[other], first[other + 1], apart, other < me
                )
                if last < 0:
                    continue
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count] = np.array([me, mine - first[me], other, last - first[other]])
                count += 1
    return found[:count]
