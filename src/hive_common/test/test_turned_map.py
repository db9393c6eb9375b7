# SPDX-License-Identifier: BSD-3-Clause
"""Maps whose origin has a yaw: what they hold is where it was, and no wall gets a gap."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from scipy import ndimage

import hive_common.turned_map
from hive_common.errors import MapError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.map_file import MAX_CELLS
from hive_common.pose import Pose, compose, inverse
from hive_common.turned_map import MAX_DRAWN, TurnedMap, bounds_around

if TYPE_CHECKING:
    from numpy.typing import NDArray

STEP = 0.1
ANGLES = [0.02, math.radians(30), math.radians(45), 1.0, math.radians(100), -2.5, 1000.0]
WITH_CORNERS = np.ones((3, 3))  # cells that touch at a corner are neighbours too


def turned(cells: NDArray[np.int8], yaw: float, resolution: float = STEP) -> TurnedMap:
    """Return a map with its lower left corner at (2, -3), turned by a yaw."""
    return TurnedMap(cells, resolution, Pose(2.0, -3.0, yaw))


def some(seed: int, occupied: float = 0.4) -> NDArray[np.int8]:
    """Return 9 x 13 cells of which a share is occupied."""
    random = np.random.default_rng(seed)
    return np.where(random.random((9, 13)) < occupied, OCCUPIED, FREE).astype(np.int8)


def middle(grid: GridMap, row: int, column: int) -> Pose:
    """Return the middle of a cell, frame map."""
    x, y, _ = grid.origin
    return Pose(x + (column + 0.5) * grid.resolution, y + (row + 0.5) * grid.resolution)


def cell_of(source: TurnedMap, point: Pose) -> tuple[int, int]:
    """Return the row and column of a turned map that hold a point, frame map; it may be off it."""
    there = compose(inverse(source.origin), point)
    return math.floor(there.y / source.resolution), math.floor(there.x / source.resolution)


@pytest.mark.parametrize(
    ("yaw", "shape"),
    [
        (0.0, (9, 13)),
        (math.pi / 2, (13, 9)),
        (3.1416, (9, 13)),
        (-math.pi, (9, 13)),
        (-math.pi / 2, (13, 9)),
        (2.5 * math.pi, (13, 9)),
        (math.pi / 2 + 0.00009, (13, 9)),
    ],
)
def test_a_right_angle_changes_no_cell(yaw: float, shape: tuple[int, int]) -> None:
    cells = np.random.default_rng(1).integers(-128, 128, (9, 13)).astype(np.int8)
    source = turned(cells, yaw)

    grid = source.upright()

    assert grid.cells.shape == shape
    assert grid.origin.yaw == 0.0
    assert grid.bounds == pytest.approx(bounds_around(source.origin, (1.3, 0.9)), abs=2e-4)
    for row, column in np.ndindex(shape):
        assert grid.cells[row, column] == cells[cell_of(source, middle(grid, row, column))]


@pytest.mark.parametrize("yaw", [0.00009, -0.00009, 2 * math.pi])
def test_a_yaw_that_is_rounding_is_none(yaw: float) -> None:
    grid = turned(some(1), yaw).upright()

    assert (grid.cells == some(1)).all()
    assert grid.origin == (2.0, -3.0, 0.0)


def test_the_bounds_around_a_turned_rectangle_are_those_of_its_corners() -> None:
    quarter = bounds_around(Pose(1.0, 2.0, math.pi / 2), (3.0, 1.0))
    eighth = bounds_around(Pose(0.0, 0.0, math.pi / 4), (2.0, 2.0))

    assert quarter == pytest.approx((0.0, 2.0, 1.0, 5.0))
    assert eighth == pytest.approx((-math.sqrt(2), 0.0, math.sqrt(2), 2 * math.sqrt(2)))


@pytest.mark.parametrize("yaw", ANGLES)
def test_a_turned_map_ends_where_its_corners_are(yaw: float) -> None:
    grid = turned(some(1), yaw).upright()

    expected = bounds_around(Pose(2.0, -3.0, yaw), (1.3, 0.9))
    assert grid.resolution == STEP
    for found, least in zip(grid.bounds, expected, strict=True):
        assert abs(found - least) < STEP
    assert grid.bounds[0] <= expected[0] <= expected[2] <= grid.bounds[2]
    assert grid.bounds[1] <= expected[1] <= expected[3] <= grid.bounds[3]


@pytest.mark.parametrize("yaw", ANGLES)
def test_a_cell_is_occupied_if_its_middle_is_and_only_if_something_occupied_touches_it(
    yaw: float,
) -> None:
    source = turned(some(2), yaw)

    grid = source.upright()

    where = np.argwhere(source.cells == OCCUPIED)
    for row, column in np.ndindex(grid.cells.shape):
        point = middle(grid, row, column)
        there = compose(inverse(source.origin), point)
        at = (there.y / STEP, there.x / STEP)
        nearest = np.hypot(*(at - at_most(at, where)).T).min()
        if nearest == 0.0:
            assert grid.cells[row, column] == OCCUPIED
        elif nearest > math.sqrt(0.5):
            assert grid.cells[row, column] != OCCUPIED


def at_most(at: tuple[float, float], cells: NDArray[np.intp]) -> NDArray[np.float64]:
    """Return the point of each cell (n, 2) that is nearest to a point [cells]."""
    nearest: NDArray[np.float64] = np.clip(at, cells, cells + 1)
    return nearest


@pytest.mark.parametrize("yaw", ANGLES)
def test_a_cell_is_free_only_if_its_middle_is_free_and_on_the_map(yaw: float) -> None:
    source = turned(some(3), yaw)

    grid = source.upright()

    free = np.argwhere(grid.cells == FREE)
    assert len(free) > 0
    for row, column in free:
        at = cell_of(source, middle(grid, row, column))
        assert min(at) >= 0
        assert source.cells[at] == FREE


@pytest.mark.parametrize("yaw", [math.radians(angle) for angle in range(1, 90, 4)])
def test_a_wall_one_cell_thick_has_no_gap_not_even_over_a_corner(yaw: float) -> None:
    cells = np.zeros((40, 50), dtype=np.int8)
    cells[12:28, 15] = cells[12:28, 35] = cells[12, 15:36] = cells[27, 15:36] = OCCUPIED
    source = turned(cells, yaw)

    grid = source.upright()

    regions, _ = ndimage.label(grid.cells == FREE, WITH_CORNERS)
    inside = grid.cell(compose(source.origin, Pose(2.5, 2.0)))
    outside = grid.cell(compose(source.origin, Pose(0.5, 0.5)))
    assert inside is not None
    assert outside is not None
    assert 0 != regions[inside] != regions[outside] != 0


@pytest.mark.parametrize("neighbours", [None, WITH_CORNERS])
@pytest.mark.parametrize("seed", range(40))
def test_no_way_opens_that_the_map_as_it_was_does_not_have(
    seed: int, neighbours: NDArray[np.float64] | None
) -> None:
    source = turned(some(seed), ANGLES[seed % len(ANGLES)])

    grid = source.upright()

    were, _ = ndimage.label(source.cells == FREE, neighbours)
    are, count = ndimage.label(grid.cells == FREE, neighbours)
    for region in range(1, count + 1):
        cells = np.argwhere(are == region)
        assert len({were[cell_of(source, middle(grid, *cell))] for cell in cells}) == 1


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (0, 30, 30),
        (30, 49, 49),
        (FREE, UNKNOWN, UNKNOWN),
        (49, UNKNOWN, UNKNOWN),
        (50, UNKNOWN, 50),
        (60, 70, 70),
        (UNKNOWN, OCCUPIED, OCCUPIED),
        (-128, 49, -128),
        (-128, UNKNOWN, UNKNOWN),
        (OCCUPIED, 127, 127),
    ],
)
def test_where_two_values_meet_the_one_that_hinders_more_stays(
    one: int, other: int, expected: int
) -> None:
    cells = np.full((20, 20), one, dtype=np.int8)
    cells[:, 10:] = other
    source = turned(cells, 0.5)

    grid = source.upright()

    for y in np.arange(0.4, 1.6, 0.03):
        cell = grid.cell(compose(source.origin, Pose(1.0, y)))
        assert cell is not None
        assert grid.cells[cell] == expected
    assert set(np.unique(grid.cells)) <= {one, other, UNKNOWN}


def test_a_map_in_strips_is_that_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = turned(some(4), 0.7).upright()
    monkeypatch.setattr(hive_common.turned_map, "_POINTS", 200)

    assert (turned(some(4), 0.7).upright().cells == whole.cells).all()


def test_a_map_that_would_be_too_large_is_refused_in_one_line_before_it_takes_the_memory() -> None:
    corridor = np.zeros((100, 12_000), dtype=np.int8)

    with pytest.raises(MapError, match=r"turned by 0\.785 rad.* more than 51,000,000") as caught:
        turned(corridor, 0.785).upright()
    assert "\n" not in str(caught.value)
    assert "turn the map's image instead" in str(caught.value)
    assert turned(corridor, math.pi / 2).upright().cells.shape == (12_000, 100)


def test_a_square_map_of_the_greatest_size_can_be_turned_by_any_angle() -> None:
    side = math.isqrt(MAX_CELLS)
    grid = turned(np.zeros((side, side), dtype=np.int8), math.pi / 4).upright()

    assert MAX_CELLS < grid.cells.size <= MAX_DRAWN
