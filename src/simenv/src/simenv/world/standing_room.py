# SPDX-License-Identifier: BSD-3-Clause
"""Where there is room: for a robot that is put down, for a door that is shut."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely.geometry

if TYPE_CHECKING:
    from collections.abc import Mapping

    from shapely.geometry.base import BaseGeometry

    from hive_common.geometry import Footprint
    from hive_common.pose import Pose
    from simenv.world.obstacles import Obstacles
    from simenv.world.world import World

REMEDY = "choose a free place"


def why_not_there(
    footprint: Footprint,
    pose: Pose,
    world: World,
    obstacles: Obstacles,
    robots: Mapping[str, tuple[Footprint, Pose]],
) -> str | None:
    """Return why a robot cannot stand somewhere, and what to do; None where it can.

    Args:
        footprint: Of the robot.
        pose: Where it would stand, frame map.
        world: What stays where it is.
        obstacles: What else is in the way.
        robots: The others and where they are.
    """
    if not all(map(math.isfinite, pose)):
        return "x, y and yaw must be numbers"
    area = shapely.geometry.Polygon(footprint.at(pose))
    width, depth = world.size
    if not area.within(shapely.geometry.box(0.0, 0.0, width, depth)):
        return (
            f"that is outside the world '{world.name}', which reaches from (0, 0) to "
            f"({width:g}, {depth:g}) m; {REMEDY}"
        )
    solid = world.solid_at(area)
    if solid is not None:
        return f"'{solid}' is there; {REMEDY}"
    for obstacle in obstacles.now:
        if footprint.touches(pose, obstacle.edges):
            return f"'{obstacle.name}' is there; {REMEDY}"
    other = robot_at(area, robots)
    return f"{other} is there; {REMEDY}" if other is not None else None


def robot_at(area: BaseGeometry, robots: Mapping[str, tuple[Footprint, Pose]]) -> str | None:
    """Return a robot that an area overlaps, frame map, or None."""
    for name, (footprint, pose) in robots.items():
        if area.intersects(shapely.geometry.Polygon(footprint.at(pose))):
            return name
    return None
