# SPDX-License-Identifier: BSD-3-Clause
"""Finds what of a fleet file does not fit the building: its world, or the map that robots have.

A robot that starts in a wall would only be refused when everything else has started.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fleet_manager.config.fleet_file import base_of
from hive_common.checked_yaml import error_at
from hive_common.errors import FileError
from hive_common.grid_map import OCCUPIED
from simenv.world.obstacles import Obstacles

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fleet_manager.config.fleet_file import Fleet, FleetRobot
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose
    from simenv.world.world import World


def building_mistakes(
    fleet: Fleet, world: World | None, chart: GridMap | None
) -> Iterator[FileError]:
    """Yield what of a fleet lies where it cannot be: starts and chargers, and zones off the map.

    Args:
        fleet: A fleet file. Robots whose model is missing are passed over: its reader names them.
        world: What is simulated; None for a real building.
        chart: The robots' map; None where there is none to check.
    """
    obstacles = Obstacles(world) if world is not None else None
    for index, robot in enumerate(fleet.robots):
        reason = _why_no_start(robot, obstacles, chart)
        if reason:
            problem = f"{robot.name} cannot start at {robot.pose}: {reason}"
            yield error_at(fleet.path, ("robots", index, "pose"), problem)
    for index, charger in enumerate(fleet.chargers or ()):
        reason = _why_no_place(charger.pose, world, chart)
        if reason:
            problem = (
                f"no robot can stand at the charger '{charger.name}', {charger.pose}: {reason}"
            )
            yield error_at(fleet.path, ("chargers", index, "pose"), problem)
    if chart is not None:
        yield from _zones_off(fleet, chart)


def _why_no_start(robot: FleetRobot, obstacles: Obstacles | None, chart: GridMap | None) -> str:
    """Return why a robot cannot start where it is said to; empty if it can."""
    reason = ""
    try:
        base = base_of(robot)
    except FileError:
        return ""
    if obstacles is not None and (robot.simulated or not robot.is_agv):
        reason = obstacles.refusal(base, robot.pose)
    if reason or chart is None:
        return reason
    refusal = chart.refusal(robot.pose)
    if refusal:
        return f"that {refusal}"
    return _why_too_near(robot.pose, float(base.limits.min()), chart)


def _why_too_near(pose: Pose, radius: float, chart: GridMap) -> str:
    """Return what of the map a circle around a pose overlaps by more than a cell; empty if none.

    The circle inside the base is reckoned with: which way a robot looks that is put down by hand
    is not known exactly.
    """
    reach = int(radius / chart.resolution) + 1
    row, column = (max(number - reach, 0) for number in chart.cell(pose) or (0, 0))
    around = chart.cells[row : row + 2 * reach + 1, column : column + 2 * reach + 1]
    rows, columns = np.nonzero(around == OCCUPIED)
    middles = np.column_stack([column + columns + 0.5, row + rows + 0.5]) * chart.resolution
    middles += chart.origin[:2]
    gaps = np.hypot(*(middles - pose[:2]).T)
    if not len(gaps) or gaps.min() >= radius - chart.resolution:
        return ""
    x, y = middles[gaps.argmin()]
    return (
        f"the map is occupied at ({x:.2f}, {y:.2f}), {gaps.min():.2f} m away, and the base "
        f"needs {radius:.2f} m; choose a free place"
    )


def _why_no_place(pose: Pose, world: World | None, chart: GridMap | None) -> str:
    """Return why no robot can stand at a pose; empty if one can."""
    reason = ""
    if world is not None:
        reason = world.refusal_at(pose.x, pose.y)
    if reason or chart is None:
        return reason
    refusal = chart.refusal(pose)
    return refusal and f"that {refusal}"


def _zones_off(fleet: Fleet, chart: GridMap) -> Iterator[FileError]:
    """Yield the zones that lie beside the map: most often their corners are in other units."""
    x_min, y_min, x_max, y_max = chart.bounds
    for index, zone in enumerate(fleet.zones):
        xs, ys = zip(*zone.corners, strict=True)
        if max(xs) <= x_min or min(xs) >= x_max or max(ys) <= y_min or min(ys) >= y_max:
            problem = (
                f"x {min(xs):g}..{max(xs):g}, y {min(ys):g}..{max(ys):g} [m] is beside the map; "
                f"allowed: x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}"
            )
            yield error_at(fleet.path, ("zones", index, "corners"), problem)
