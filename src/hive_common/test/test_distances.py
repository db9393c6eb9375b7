# SPDX-License-Identifier: BSD-3-Clause
"""Distances to blocked cells: the same in strips as at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

import hive_common.distances
from hive_common.distances import distances

if TYPE_CHECKING:
    from numpy.typing import NDArray

REACH = 9.0


def floor(seed: int) -> NDArray[np.bool_]:
    """Return a map of 90 x 40 cells with some blocked ones."""
    return np.random.default_rng(seed).random((90, 40)) < 0.004


def up_to_reach(blocked: NDArray[np.bool_], *, walled: bool) -> NDArray[np.float64]:
    """Return all distances of a map, at most the reach."""
    found = np.concatenate([cells for _, cells in distances(blocked, REACH, walled=walled)])
    return np.minimum(found, REACH)


@pytest.mark.parametrize("walled", [True, False])
@pytest.mark.parametrize("seed", range(5))
def test_a_map_in_strips_has_the_distances_of_the_whole(
    seed: int, walled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocked = floor(seed)
    whole = up_to_reach(blocked, walled=walled)
    monkeypatch.setattr(hive_common.distances, "CELLS", 1)

    assert len(list(distances(blocked, REACH))) > 3
    assert np.array_equal(up_to_reach(blocked, walled=walled), whole)


def test_the_distance_of_a_cell_is_that_to_the_middle_of_the_nearest_blocked_one() -> None:
    blocked = np.zeros((20, 20), dtype=bool)
    blocked[10, 10] = True

    assert up_to_reach(blocked, walled=False)[7, 6] == 5.0


def test_a_map_without_a_blocked_cell_has_only_its_walls() -> None:
    blocked = np.zeros((20, 20), dtype=bool)

    assert up_to_reach(blocked, walled=True)[0, 3] == 1.0
    assert up_to_reach(blocked, walled=False).min() == REACH
