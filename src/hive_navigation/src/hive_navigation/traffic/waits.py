# SPDX-License-Identifier: BSD-3-Clause
"""Who waits for whom, and where: the order of a plan, as robots are told it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_navigation.mapf.dependency_graph import Course, dependencies
from hive_navigation.mapf.route import Wait
from hive_navigation.traffic.right_of_way import GAP
from hive_navigation.traffic.zone_order import zone_waits

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.zone import Zone
    from hive_navigation.traffic.committed import Drive


class Part(NamedTuple):
    """One robot's part of a plan.

    Attributes:
        name: The robot.
        radius: Of the circle around its footprint [m].
        drive: Its course.
        decided: The index of the point of it up to which the robot cannot avoid it any more.
        planned: Whether it can be reckoned with; see `Tracked.is_planned`.
    """

    name: str
    radius: float
    drive: Drive
    decided: int
    planned: bool


def waits_of(parts: Sequence[Part], zones: Sequence[Zone]) -> list[tuple[Wait, ...]]:
    """Return for each robot whom it lets pass first.

    What a robot cannot avoid any more, and robots that cannot be reckoned with, are left to the
    right of way.

    Args:
        parts: One for each robot.
        zones: Those that are open.
    """
    drives = [part.drive for part in parts]
    courses = [
        Course(
            np.array(drive.points),
            np.array([*drive.leaves[:-1], drive.arrives[-1]]),
            part.radius,
        )
        for part, drive in zip(parts, drives, strict=True)
    ]
    waits: list[list[Wait]] = [[] for _ in parts]
    for me, mine, other, its in [*dependencies(courses, GAP).tolist(), *zone_waits(drives, zones)]:
        if mine >= parts[me].decided and parts[other].planned:
            at, passes = drives[me].marks[mine], drives[other].passed_after(its)
            waits[me].append(Wait(at=at, robot=parts[other].name, passes=passes))
    return [tuple(each) for each in waits]
