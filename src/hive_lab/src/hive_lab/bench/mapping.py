# SPDX-License-Identifier: BSD-3-Clause
"""A mapping run without ROS, and how well the map agrees with the world.

`./hive shell -c "python3 -m hive_lab.bench.mapping docs/images/mapping.png"` draws it.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import PIL.Image
import PIL.ImageDraw
from scipy import ndimage

from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN
from hive_common.pose import Pose
from hive_lab.bench.registry import BenchResult
from hive_navigation.mapping.explorer import Explorer
from hive_navigation.mapping.mapper import Mapper
from hive_navigation.mapping.occupancy import OccupancyGrid
from robot_description.models import load_model
from robot_description.scan import Scan
from simenv.simulation import Simulation
from simenv.world.draw_map import RESOLUTION, draw_map
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.grid_map import GridMap

STEPS_PER_SCAN = 4  # the robot scans at 10 Hz
SCANS_PER_PLAN = 20  # a new path is planned every 2 s: the robot may see a frontier in passing
LONGEST = 1800.0  # time limit of a run [s]

WORLD, MODEL, START = "lab", "ld60", (2.6, 2.0, 0.0)
"""The world, the robot's model, and its start [m, m, rad]."""

AIMS = {"wrong": 0.03, "wall_error": 0.10}
"""Largest share of wrong known cells, and largest error of walls [m]."""

WHITE, GREY, BLACK, RED = (255, 255, 255), (205, 205, 205), (0, 0, 0), (214, 39, 40)

SCALE = 2  # side of a cell [px]
GAP = 20  # gap between the two maps [px]


@dataclass(frozen=True)
class Explored:
    """A finished run.

    Attributes:
        chart: The robot's map.
        duration: Simulated time [s].
        scans: Number of scans in the map.
        lost: Largest error of the mapper's position [m].
        way: The mapper's positions, frame map [m].
    """

    chart: GridMap
    duration: float
    scans: int
    collisions: int
    lost: float
    way: list[tuple[float, float]]


@dataclass(frozen=True)
class Agreement:
    """How well a map shows a world.

    Attributes:
        share: Share of the known cells that agree with the world.
        known: Share of the visible cells that are known.
        wall_error: 99th percentile of the distance of occupied cells to something solid [m].
    """

    share: float
    known: float
    wall_error: float


def explore(world: str, model: str, start: tuple[float, float, float], seed: int = 1) -> Explored:
    """Let a robot explore a world alone from a pose, frame map, with the usual drift and noise."""
    simulation = Simulation(load_world(world), seed=seed)
    body = load_model(model)
    simulation.add_robot("robot1", body, start)
    grid = OccupancyGrid(simulation.world.size, (0.0, 0.0), RESOLUTION)
    mapper = Mapper(Pose(*body.laser.pose), Pose(*start), grid)
    explorer = Explorer(body.base.circumscribed_radius, body.base.max_speed)
    lost, looks, way = 0.0, 0, []
    while not explorer.finished and simulation.time < LONGEST:
        scan = Scan.of(body.laser, simulation.scan("robot1"))
        mapper.see(simulation.odometry("robot1"), scan)
        way.append(mapper.pose[:2])
        truth = simulation.poses["robot1"]
        lost = max(lost, float(np.hypot(truth.x - mapper.pose.x, truth.y - mapper.pose.y)))
        if looks % SCANS_PER_PLAN == 0:
            explorer.plan(mapper.grid.as_map(), mapper.pose)
        looks += 1
        vx, wz = explorer.steer(mapper.pose)
        simulation.set_command("robot1", vx=vx, wz=wz)
        for _ in range(STEPS_PER_SCAN):
            simulation.step()
    mapper.refine()
    chart = mapper.grid.as_map()
    return Explored(chart, simulation.time, mapper.scans, simulation.collisions, lost, way)


def compare(chart: GridMap, world: str) -> Agreement:
    """Compare a map, whose origin is not rotated, with that of a perfect mapper."""
    truth = truth_for(chart, world)
    known = (chart.cells != UNKNOWN) & (truth != UNKNOWN)
    # A perfect mapper sees surfaces, not what is behind them.
    surface = (truth == OCCUPIED) & ndimage.binary_dilation(truth == FREE, np.ones((3, 3)))
    visible = (truth == FREE) | surface
    away = ndimage.distance_transform_edt(truth != OCCUPIED) * chart.resolution
    errors = away[chart.cells == OCCUPIED]
    return Agreement(
        share=float((chart.cells == truth)[known].mean()),
        known=float((chart.cells != UNKNOWN)[visible].mean()),
        wall_error=float(np.quantile(errors, 0.99)) if errors.size else 0.0,
    )


def truth_for(chart: GridMap, world: str) -> NDArray[np.int8]:
    """Return the cells of a perfect mapper's map."""
    cells = draw_map(load_world(world), chart.resolution).cells
    found = np.full(chart.cells.shape, UNKNOWN, dtype=np.int8)
    first = (round(chart.origin[i] / chart.resolution) for i in (1, 0))
    rows, columns = (np.arange(n) + start for n, start in zip(found.shape, first, strict=True))
    inside = (rows >= 0) & (rows < len(cells)), (columns >= 0) & (columns < cells.shape[1])
    found[np.ix_(*inside)] = cells[np.ix_(rows[inside[0]], columns[inside[1]])]
    return found


def run() -> BenchResult:
    """Measure on the lab, explored alone from the first start.

    Returns:
        `wrong`, the share of the known cells that differ from the world, and `known`, `wall_error`
        [m], `lost` [m], `duration` [s], `collisions`; see `Agreement` and `Explored`.
    """
    found = explore(WORLD, MODEL, START)
    agreement = compare(found.chart, WORLD)
    figures = {
        "wrong": 1.0 - agreement.share,
        "known": agreement.known,
        "wall_error": agreement.wall_error,
        "lost": found.lost,
        "duration": found.duration,
        "collisions": float(found.collisions),
    }
    return BenchResult(figures, AIMS)


def main() -> None:
    """Draw the lab beside the robot's map of it, into the file on the command line."""
    if len(sys.argv) != 2:  # noqa: PLR2004  (the program and its argument)
        sys.exit("usage: python3 -m hive_lab.bench.mapping FILE.png")
    found = explore(WORLD, MODEL, START)
    truth = truth_for(found.chart, WORLD)
    sides = [_drawn(truth), _drawn(found.chart.cells)]
    way = (np.array(found.way) - found.chart.origin[:2]) / found.chart.resolution * SCALE
    PIL.ImageDraw.Draw(sides[1]).line(
        [(x, sides[1].height - y) for x, y in way.tolist()], fill=RED, width=2
    )
    width, height = sides[0].size
    picture = PIL.Image.new("RGB", (2 * width + GAP, height), WHITE)
    for column, side in enumerate(sides):
        picture.paste(side, (column * (width + GAP), 0))
    _known(picture).save(sys.argv[1])


def _known(picture: PIL.Image.Image) -> PIL.Image.Image:
    """Return a picture without the rows in which nothing is known."""
    pixels = np.asarray(picture)
    known = (pixels == BLACK).all(axis=2).any(axis=1)
    rows = np.flatnonzero(known)
    return picture.crop((0, int(rows[0]), picture.width, int(rows[-1]) + 1))


def _drawn(cells: NDArray[np.int8]) -> PIL.Image.Image:
    """Return cells, row 0 at the bottom, as a picture."""
    pixels = np.full((*cells.shape, 3), GREY, dtype=np.uint8)
    pixels[cells == FREE] = WHITE
    pixels[cells == OCCUPIED] = BLACK
    return PIL.Image.fromarray(pixels[::-1].repeat(SCALE, axis=0).repeat(SCALE, axis=1))


if __name__ == "__main__":
    main()
