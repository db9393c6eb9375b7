# SPDX-License-Identifier: BSD-3-Clause
"""The map that a perfect mapper would make of a world.

A cell is occupied if anything solid reaches into it. It is free if a robot's laser can see it one
day: if free cells connect it to a named place of the world. The rest is unknown.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely.geometry
from scipy import ndimage

from hive_common.errors import HiveError, MapError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.map_file import COARSEST, MAX_CELLS, save_map
from simenv.world.shapes import outline_of
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from simenv.world.world import World

RESOLUTION = 0.05  # the default size of a cell [m]
_TOUCH = 1e-6  # how far something must reach into a cell to count [m]


def draw_map(world: World, resolution: float = RESOLUTION) -> GridMap:
    """Draw the map of a world in cells of `resolution` [m], its lower left corner at (0, 0).

    Raise MapError if the resolution gives no map.
    """
    if not 0 < resolution <= COARSEST:
        raise MapError(
            f"resolution {resolution} m; allowed: above 0 and at most {COARSEST:g}, "
            f"usual {RESOLUTION}"
        )
    width, height = (math.ceil(side / resolution - _TOUCH) for side in world.size)
    if width * height > MAX_CELLS:
        raise MapError(
            f"resolution {resolution} m gives {width} x {height} cells; choose a coarser one"
        )
    solid = _inside(world, resolution, (height, width))
    cells = np.full(solid.shape, UNKNOWN, dtype=np.int8)
    cells[_reachable(world, ~solid, resolution)] = FREE
    cells[solid] = OCCUPIED
    return GridMap(cells, resolution)


def _inside(world: World, resolution: float, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return which cells something solid reaches into.

    Everything grows by half a cell; then a cell counts if its centre is inside, which is so if an
    odd number of the outline's crossings with the cell's row lie to its left.
    """
    larger = world.solid.buffer(
        resolution / 2 - _TOUCH, join_style=shapely.geometry.JOIN_STYLE.mitre
    )
    inside = np.zeros(shape, dtype=bool)
    (x0, y0), (x1, y1) = outline_of(larger).transpose(1, 2, 0)
    centres = (np.arange(shape[1]) + 0.5) * resolution
    for row in range(shape[0]):
        y = (row + 0.5) * resolution
        crossed = (y0 <= y) != (y1 <= y)
        share = (y - y0[crossed]) / (y1[crossed] - y0[crossed])
        crossings = np.sort(x0[crossed] + share * (x1[crossed] - x0[crossed]))
        inside[row] = np.searchsorted(crossings, centres) % 2 == 1
    return inside


def _reachable(
    world: World, open_cells: NDArray[np.bool_], resolution: float
) -> NDArray[np.bool_]:
    """Return which open cells connect to a place of the world; all if it has no places."""
    places = world.places
    if not places:
        return open_cells
    regions, _ = ndimage.label(open_cells)
    height, width = open_cells.shape
    seen = {
        int(
            regions[
                min(int(place.pose.y / resolution), height - 1),
                min(int(place.pose.x / resolution), width - 1),
            ]
        )
        for place in places
    }
    reachable: NDArray[np.bool_] = np.isin(regions, sorted(seen - {0}))
    return reachable


def main(arguments: list[str] | None = None) -> int:
    """Run `rosrun simenv draw_map`: draw the map of a world and write it; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="draw_map",
        description="Draw the map that a perfect mapper would make of a world.",
        epilog="example: rosrun simenv draw_map lab maps/lab",
    )
    parser.add_argument("world", help="name of a file in worlds/, or the path of another")
    parser.add_argument("map", type=Path, help="the map's path without suffix")
    parser.add_argument(
        "--resolution", type=float, default=RESOLUTION, help="size of a cell [m] (%(default)s)"
    )
    given = parser.parse_args(arguments)
    try:
        save_map(draw_map(load_world(given.world), given.resolution), given.map)
    except HiveError as error:
        print(f"draw_map: {error}", file=sys.stderr)  # noqa: T201  (a command's one output)
        return 1
    return 0
