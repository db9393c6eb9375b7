# SPDX-License-Identifier: BSD-3-Clause
"""The Voronoi diagram of places: the same in strips as at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hive_common.distances
from hive_common.grid_map import GridMap
from hive_navigation.mapf import voronoi
from hive_navigation.mapf.voronoi import AT_WALL, Meetings, Voronoi
from hive_navigation.planning.clearance import ClearanceField

if TYPE_CHECKING:
    from numpy.typing import NDArray

NEED = 0.2  # [m]


def field(blocked: NDArray[np.bool_]) -> ClearanceField:
    """Return the clearances of a map with cells of 0.05 m."""
    return ClearanceField.of(GridMap.of_blocked(blocked, 0.05))


def drawn(seed: int) -> tuple[ClearanceField, Voronoi]:
    """Return a map of 20 m x 4 m with boxes, and the diagram of 30 places on it."""
    random = np.random.default_rng(seed)
    blocked = np.zeros((400, 80), dtype=bool)
    for row, column in random.integers((0, 0), (400, 80), (30, 2)):
        blocked[row : row + 12, column : column + 6] = True
    clear = field(blocked)
    free = np.flatnonzero(clear.clearance >= NEED)
    starts = random.choice(free, 30, replace=False)
    diagram = Voronoi(clear.clearance, clear.clearance >= NEED, NEED, starts, np.arange(30))
    return clear, diagram


def as_set(meetings: Meetings) -> set[tuple[float, ...]]:
    """Return meetings without their order: two ways may cost the same."""
    return {
        (round(cost, 6), *sorted(places))
        for cost, places in zip(meetings.costs.tolist(), meetings.places.tolist(), strict=True)
    }


@pytest.mark.parametrize("seed", range(5))
def test_a_map_in_strips_has_the_meetings_of_the_whole(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, diagram = drawn(seed)
    whole = as_set(diagram.meetings(np.arange(30)))
    monkeypatch.setattr(hive_common.distances, "CELLS", 1)

    assert len(whole) > 20
    assert as_set(diagram.meetings(np.arange(30))) == whole


@pytest.mark.parametrize("seed", range(5))
def test_a_way_leads_over_neighbouring_free_cells_from_one_place_to_the_other(seed: int) -> None:
    clear, diagram = drawn(seed)
    met = diagram.meetings(np.arange(30))

    for (one, other), cost in zip(met.cells.tolist(), met.costs.tolist(), strict=True):
        way = diagram.way(one, other)
        rows, columns = np.divmod(way, 80)
        assert (np.abs(np.diff(rows)) + np.abs(np.diff(columns)) == 1).all()
        assert (clear.clearance[rows, columns] >= NEED).all()
        assert len(way) - 2 <= cost <= AT_WALL * len(way)


def test_a_way_keeps_away_from_walls() -> None:
    blocked = np.zeros((60, 200), dtype=bool)
    blocked[:3] = blocked[-3:] = True
    clear = field(blocked)
    starts = np.array([10 * 200 + 10, 10 * 200 + 190])
    diagram = Voronoi(clear.clearance, clear.clearance >= NEED, NEED, starts, np.arange(2))
    (one, other), *_ = diagram.meetings(np.arange(2)).cells.tolist()

    rows = np.divmod(diagram.way(one, other), 200)[0]

    assert clear.clearance[rows, 100].max() >= NEED + 0.3


def test_a_cell_that_no_place_reaches_belongs_to_none_and_costs_no_look_at_the_whole_map(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    random = np.random.default_rng(1)
    clearance = np.full((3000, 20), 1.0, dtype=np.float32)
    inside = np.ones(clearance.shape, dtype=bool)
    inside[1500:1503, :3] = False
    inside[1501, 1] = True
    starts = np.flatnonzero(inside)[::400]
    sizes: list[int] = []
    whole = voronoi.grown

    def watched(part: NDArray[np.float32], *others: Any) -> Any:
        sizes.append(len(part))
        return whole(part, *others)

    monkeypatch.setattr(voronoi, "grown", watched)
    monkeypatch.setattr(hive_common.distances, "CELLS", 1)
    diagram = Voronoi(clearance, inside, NEED, starts, random.permutation(len(starts)))

    assert len(diagram.meetings(np.arange(len(starts))).costs) >= len(starts) - 1
    assert max(sizes) < 1500
