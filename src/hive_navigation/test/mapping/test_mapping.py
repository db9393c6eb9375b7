# SPDX-License-Identifier: BSD-3-Clause
"""Maps from scans: drawing, scan matching, a short drive, and exploring."""

from __future__ import annotations

import math
import re
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import yaml
from scipy import ndimage

from hive_common.errors import ParameterError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.pose import Pose
from hive_lab.bench.mapping import compare
from hive_navigation.mapping.explorer import MARGIN, SPEED, Explorer
from hive_navigation.mapping.mapper import Mapper
from hive_navigation.mapping.mapper_settings import MapperSettings
from hive_navigation.mapping.occupancy import OccupancyGrid
from hive_navigation.mapping.scan_matcher import ScanMatcher
from hive_navigation.mapping.surfaces import Surfaces
from robot_description.models import load_model
from robot_description.scan import Scan
from simenv.simulation import Simulation
from simenv.world.draw_map import draw_map
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from hive_common.geometry import Array

LASER = load_model("ld60").laser
MOUNT = Pose(*LASER.pose)
ANGLES = Scan.of(LASER, np.ones(LASER.beams)).angles
START = Pose(5.0, 3.0, 0.0)


def lab(start: Pose = START) -> Simulation:
    simulation = Simulation(load_world("lab"), seed=1)
    simulation.add_robot("robot1", load_model("ld60"), start)
    return simulation


def test_a_beam_frees_the_cells_it_passes_and_fills_the_one_it_ends_in() -> None:
    grid = OccupancyGrid((4.0, 2.0), (0.0, 0.0), 0.05)

    grid.add(Pose(1.025, 1.025, 0.0), np.zeros(1), np.array([1.0]), 3.0)

    row = grid.as_map().cells[20]
    assert set(row[20:40]) == {FREE}
    assert row[41] == OCCUPIED or row[40] == OCCUPIED
    assert set(row[43:]) == {UNKNOWN}


@pytest.mark.parametrize("nothing", [-math.inf, math.nan])
def test_a_beam_with_an_unknown_range_changes_nothing(nothing: float) -> None:
    grid = OccupancyGrid((4.0, 2.0), (0.0, 0.0), 0.05)

    grid.add(Pose(1.0, 1.0, 0.0), np.zeros(1), np.array([nothing]), 3.0)

    assert not grid.odds.any()


def test_a_beam_that_hits_nothing_frees_all_cells_in_its_range() -> None:
    grid = OccupancyGrid((5.0, 2.0), (0.0, 0.0), 0.05)

    grid.add(Pose(1.025, 1.025, 0.0), np.zeros(1), np.array([math.inf]), 3.0)

    cells = grid.as_map().cells
    assert (cells == OCCUPIED).sum() == 0
    assert set(cells[20, 20:79]) == {FREE}


def test_a_grid_grows_to_where_a_scan_reaches_and_keeps_its_cells() -> None:
    grid = OccupancyGrid((2.0, 2.0), (0.0, 0.0), 0.05)
    grid.add(Pose(1.025, 1.025, 0.0), np.zeros(1), np.array([0.5]), 3.0)
    known = grid.odds.copy()

    grid.add(Pose(1.025, 1.025, math.pi), np.zeros(1), np.array([2.0]), 3.0)

    assert grid.origin == (-5.0, 0.0)
    assert grid.odds.shape == (40, 140)
    assert (grid.odds[:, 121:] == known[:, 21:]).all()
    assert set(grid.as_map().cells[20, 82:120]) == {FREE}
    assert OCCUPIED in grid.as_map().cells[20, 79:81]


def test_a_grid_does_not_grow_beyond_the_maximum_size_of_a_map() -> None:
    grid = OccupancyGrid((2.0, 2.0), (0.0, 0.0), 0.05)

    grid.add(Pose(1e6, 1e6, 0.0), np.zeros(1), np.array([2.0]), 3.0)

    assert grid.full
    assert grid.odds.shape == (40, 40)


def test_maps_with_different_origins_are_compared_in_the_map_frame() -> None:
    perfect = draw_map(load_world("lab"))
    part = GridMap(
        np.pad(perfect.cells[20:, 40:], ((0, 30), (0, 60)), constant_values=UNKNOWN),
        0.05,
        Pose(2.0, 1.0, 0.0),
    )

    agreement = compare(part, "lab")

    assert agreement.share == 1.0
    assert agreement.wall_error == 0.0


def seen_from(pose: Pose, ranges: Array) -> Array:
    """Return where the beams of a scan ended (n, 2), frame map [m]."""
    hit = np.isfinite(ranges) & (ranges > 0)
    turned = ANGLES[hit] + pose.yaw
    arms = np.stack([ranges[hit] * np.cos(turned), ranges[hit] * np.sin(turned)], axis=1)
    ends: Array = arms + pose[:2]
    return ends


@pytest.mark.parametrize(
    "off", [Pose(0.0, 0.0, 0.0), Pose(0.06, -0.05, 0.03), Pose(-0.15, 0.1, -0.05)]
)
def test_a_scan_is_matched_to_where_it_was_taken_from_a_guess_nearby(off: Pose) -> None:
    corner = Pose(1.6, 1.6, 0.0)
    ranges = lab(corner).scan("robot1")
    surfaces = Surfaces(0.05)
    surfaces.add(seen_from(corner, ranges), corner[:2])
    guess = Pose(corner.x + off.x, corner.y + off.y, corner.yaw + off.yaw)

    found = ScanMatcher(surfaces).fit(guess, seen_from(Pose(0.0, 0.0, 0.0), ranges), 3.0)

    assert math.dist(found[:2], corner[:2]) < 0.02
    assert abs(found.yaw - corner.yaw) < 0.005


def test_along_a_bare_wall_the_odometry_decides() -> None:
    along = np.linspace(-3.0, 3.0, 300)
    wall = np.stack([along, np.full(300, 1.0)], axis=1)
    surfaces = Surfaces(0.05)
    surfaces.add(wall, (0.0, 0.0))
    middle = wall[60:240]

    found = ScanMatcher(surfaces).fit(Pose(0.08, 0.05, 0.0), middle, 3.0)

    assert found == pytest.approx((0.08, 0.0, 0.0), abs=0.005)


def test_the_other_side_of_a_thin_wall_is_not_matched() -> None:
    along = np.linspace(-3.0, 3.0, 300)
    surfaces = Surfaces(0.05)
    surfaces.add(np.stack([along, np.full(300, 1.0)], axis=1), (0.0, 0.0))
    behind = Pose(0.0, 3.0, 0.0)

    found = ScanMatcher(surfaces).fit(behind, np.stack([along, np.full(300, -1.8)], axis=1), 3.0)

    assert found == behind


def test_without_surfaces_the_odometry_is_used() -> None:
    assert ScanMatcher(Surfaces(0.05)).fit(START, np.ones((100, 2)), 3.0) == START


def test_ends_far_from_all_surfaces_are_ignored() -> None:
    surfaces = Surfaces(0.05)
    surfaces.add(np.stack([np.linspace(0.0, 3.0, 100), np.zeros(100)], axis=1), START[:2])

    assert ScanMatcher(surfaces).fit(START, np.ones((100, 2)), 3.0) == START


def test_a_surface_is_the_mean_of_the_ends_in_each_square() -> None:
    surfaces = Surfaces(0.05)
    for height in (0.51, 0.53):
        ends = np.stack([np.arange(0.025, 1.0, 0.05), np.full(20, height)], axis=1)
        surfaces.add(ends, (0.5, 0.0))

    found = surfaces.around(0.5, 0.5, 1.0)

    assert found is not None
    assert found.points[:, 1] == pytest.approx(0.52)
    assert found.normals == pytest.approx(np.tile([0.0, -1.0], (20, 1)))
    assert found.flatness == pytest.approx(1.0)
    assert surfaces.around(9.0, 9.0, 1.0) is None


def test_a_map_made_on_a_short_drive_agrees_with_the_world() -> None:
    simulation = lab()
    mapper = Mapper(MOUNT, START, OccupancyGrid(simulation.world.size, (0.0, 0.0), 0.05))
    for _ in range(120):
        mapper.see(simulation.odometry("robot1"), Scan.of(LASER, simulation.scan("robot1")))
        simulation.set_command("robot1", vx=0.3, wz=0.3)
        for _ in range(4):
            simulation.step()

    truth = simulation.poses["robot1"]
    agreement = compare(mapper.grid.as_map(), "lab")
    assert math.dist(mapper.pose[:2], truth[:2]) < 0.05
    assert agreement.share > 0.97
    assert agreement.wall_error <= 0.1


def test_the_correction_transforms_the_odometry_to_the_robots_pose() -> None:
    simulation = lab()
    mapper = Mapper(MOUNT, START, OccupancyGrid(simulation.world.size, (0.0, 0.0), 0.05))
    mapper.see(simulation.odometry("robot1"), Scan.of(LASER, simulation.scan("robot1")))

    assert mapper.correction == pytest.approx(START)


def test_an_explorer_drives_to_a_frontier() -> None:
    simulation = lab()
    mapper = Mapper(MOUNT, START, OccupancyGrid(simulation.world.size, (0.0, 0.0), 0.05))
    explorer = Explorer(0.43, 1.0)
    mapper.see(simulation.odometry("robot1"), Scan.of(LASER, simulation.scan("robot1")))

    explorer.plan(mapper.grid.as_map(), mapper.pose)

    assert not explorer.finished
    assert explorer.steer(mapper.pose) != (0.0, 0.0)


def test_an_explorer_has_finished_when_nothing_is_unknown() -> None:
    grid = OccupancyGrid((5.0, 5.0), (0.0, 0.0), 0.05)
    grid.odds[:] = -1.0
    explorer = Explorer(0.3, 1.0)

    explorer.plan(grid.as_map(), Pose(2.5, 2.5, 0.0))

    assert explorer.finished
    assert explorer.steer(Pose(2.5, 2.5, 0.0)) == (0.0, 0.0)


def frontier_ahead(free_from: float = 0.0) -> GridMap:
    """A floor of 10 m x 4 m that is free from an x on to 6 m, and unknown behind that."""
    cells = np.full((80, 200), UNKNOWN, dtype=np.int8)
    cells[:, round(free_from / 0.05) : 120] = FREE
    return GridMap(cells, 0.05, Pose(0.0, 0.0, 0.0))


@pytest.mark.parametrize("age", [0.15, 0.4, 4.0])
def test_an_explorer_drives_no_farther_than_its_margin_while_it_knows_nothing_new(
    age: float,
) -> None:
    explorer = Explorer(0.3, 1.0)
    here = Pose(2.0, 2.0, 0.0)
    explorer.plan(frontier_ahead(), here)
    fresh, _ = explorer.steer(here)
    speed, _ = explorer.steer(here, age)

    assert speed == pytest.approx(fresh * min(1.0, MARGIN / age / SPEED))
    assert speed * age <= MARGIN


def test_an_explorer_turns_but_does_not_drive_into_what_the_map_shows_ahead() -> None:
    explorer = Explorer(0.3, 1.0)
    free = frontier_ahead()
    explorer.plan(free, Pose(2.0, 2.0, 0.0))
    cells = free.cells.copy()
    cells[:, 46:48] = OCCUPIED  # 0.3 m ahead
    explorer._room = ndimage.distance_transform_edt(cells == FREE) * 0.05  # noqa: SLF001  (as after a plan)

    assert explorer.steer(Pose(2.0, 2.0, 0.1))[0] == 0.0
    assert explorer.steer(Pose(2.0, 2.0, 0.1))[1] != 0.0


def backs_off_by(explorer: Explorer, start: Pose, seconds: float = 20.0) -> float:
    """Let a stuck robot drive for a time in which no new plan is made; return how far it came."""
    here = start
    for _ in range(round(seconds / 0.1)):
        speed, _ = explorer.steer(here, 0.1)
        here = Pose(here.x + speed * 0.1, here.y, here.yaw)
    return start.x - here.x


@pytest.mark.parametrize(("free_from", "far"), [(0.0, 0.3), (1.55, 0.1), (1.7, 0.0)])
def test_a_stuck_robot_backs_off_a_little_and_only_where_there_is_room(
    free_from: float, far: float
) -> None:
    explorer = Explorer(0.3, 1.0)
    here = Pose(2.0, 2.0, 0.0)
    for _ in range(2):  # it has not moved between two plans
        explorer.plan(frontier_ahead(free_from), here)

    assert backs_off_by(explorer, here) == pytest.approx(far, abs=0.06)


def test_a_map_is_saved_with_nothing_between_free_and_occupied() -> None:
    grid = GridMap(np.array([[0, 25, 26, 64, 65, 100, -1]], dtype=np.int8), 0.05, START)

    cells = grid.decided(free=25, occupied=65).cells

    assert cells.tolist() == [[FREE, FREE, UNKNOWN, UNKNOWN, OCCUPIED, OCCUPIED, UNKNOWN]]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"delta": 0.0}, "delta: 0.0; allowed: a number above 0"),
        ({"linearUpdate": -1.0}, "linearUpdate: -1.0; allowed: a number of at least 0"),
        ({"initial_pose_x": math.nan}, "initial_pose_x: nan; allowed: a finite number"),
        ({"xmin": 6.0}, "xmax: 5.0 is not above xmin 6.0 by a cell of 0.05 m"),
        ({"xmax": 1e6}, "delta: 0.05 m is too fine for 1e+06 m x 10 m"),
    ],
)
def test_a_mapper_setting_that_is_not_allowed_is_named(wrong: dict[str, float], said: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(said)):
        MapperSettings(**wrong)


def test_the_file_of_the_mapper_holds_its_defaults() -> None:
    path = Path(__file__).parents[2] / "config" / "mapper.yaml"

    chosen = yaml.safe_load(path.read_text(encoding="utf-8"))

    assert MapperSettings(**chosen) == MapperSettings()
    starts = {"initial_pose_x", "initial_pose_y", "initial_pose_a"}
    assert set(chosen) == {field.name for field in fields(MapperSettings)} - starts
