# SPDX-License-Identifier: BSD-3-Clause
"""The warehouse that the project lays out is the one of the standard problem."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Point

from hive_lab.fleets.sites import CELL, CELLS, WALL, warehouse


def test_the_warehouse_has_ten_shelves_of_ten_cells_with_three_free_rows_between():
    site = warehouse()
    columns, rows = CELLS
    solid = np.array(
        [
            [
                site.world.solid.covers(Point(WALL + CELL * (x + 0.5), WALL + CELL * (y + 0.5)))
                for x in range(columns)
            ]
            for y in range(rows)
        ]
    )

    assert np.flatnonzero(solid.any(axis=1)).tolist() == [2, 6, 10, 14, 18]
    assert np.flatnonzero(solid[2]).tolist() == [*range(7, 17), *range(18, 28)]
    assert solid.sum() == 100
