# SPDX-License-Identifier: BSD-3-Clause
"""Draws a world beside the map that a robot made of it, for the documentation.

Run it in the environment of the workspace, with the file to write:
`./hive shell -c "python3 -m hive_lab.bench.mapping_picture docs/images/mapping.png"`.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
import PIL.Image
import PIL.ImageDraw

from hive_common.map_file import FREE, OCCUPIED
from hive_lab.bench.mapping import MODEL, START, WORLD, explore, truth_for

if TYPE_CHECKING:
    from numpy.typing import NDArray

WHITE, GREY, BLACK, RED = (255, 255, 255), (205, 205, 205), (0, 0, 0), (214, 39, 40)

SCALE = 2
"""Pixels for the side of a cell."""

GAP = 20
"""Pixels between the two."""


def main() -> None:
    """Write the picture."""
    if len(sys.argv) != 2:  # noqa: PLR2004  (the program and its argument)
        sys.exit("usage: python3 -m hive_lab.bench.mapping_picture FILE.png")
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
    """Return cells, row 0 the lowest, as a picture."""
    pixels = np.full((*cells.shape, 3), GREY, dtype=np.uint8)
    pixels[cells == FREE] = WHITE
    pixels[cells == OCCUPIED] = BLACK
    return PIL.Image.fromarray(pixels[::-1].repeat(SCALE, axis=0).repeat(SCALE, axis=1))


if __name__ == "__main__":
    main()
