# SPDX-License-Identifier: BSD-3-Clause
"""The assignment problem by shortest augmenting paths (Jonker and Volgenant, 1987).

scipy has it too, but every member that can lead would load 6 MB for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def assignment(costs: NDArray[np.float64]) -> list[int]:
    """Return a column for each row, none twice, so that the sum of the costs is least.

    An infinite cost excludes a pair. There has to be a solution without any, and at least as many
    columns as rows.
    """
    count, width = costs.shape
    of_row, of_column = np.zeros(count), np.zeros(width)  # prices: what is left of a cost is >= 0
    row_at = [-1] * width
    found = [-1] * count
    for first in range(count):
        length, came_from = np.full(width, np.inf), np.full(width, -1)
        is_open = np.ones(width, dtype=bool)
        row, column, so_far = first, -1, 0.0
        while row >= 0:
            onward = so_far + costs[row] - of_row[row] - of_column
            shorter = is_open & (onward < length)
            length[shorter], came_from[shorter] = onward[shorter], row
            column = int(np.where(is_open, length, np.inf).argmin())
            so_far, is_open[column] = float(length[column]), False
            row = row_at[column]
        of_row[first] += so_far
        for passed in np.flatnonzero(~is_open):
            saved = so_far - length[passed]
            of_column[passed] -= saved
            if row_at[passed] >= 0:
                of_row[row_at[passed]] += saved
        while row != first:
            row = int(came_from[column])
            row_at[column] = row
            found[row], column = column, found[row]
    return found
