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

from hive_navigation.mapf.segments import arcs

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
    return arcs(
        np.ascontiguousarray(np.vstack([course.points for course in courses]), dtype=np.float64),
        np.concatenate([course.begins for course in courses]).astype(np.float64),
        np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        np.array([course.radius for course in courses], dtype=np.float64),
        gap,
    )
