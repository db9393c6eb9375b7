# SPDX-License-Identifier: BSD-3-Clause
"""Which map somebody uses, so that all can be seen to use the same."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from hive_common.grid_map import GridMap

_DECIMALS = 6  # of the origin; less is rounding [m]


class MapId(NamedTuple):
    """A map's name, which people know, and its checksum, which nodes compare.

    Attributes:
        name: Of its file, without folder and ending; empty if it is not known.
        checksum: See `checksum_of`; empty for no map.
    """

    name: str = ""
    checksum: str = ""

    def __str__(self) -> str:
        """Return it in words."""
        if not self.checksum:
            return "no map"
        return f"map '{self.name}' ({self.checksum})" if self.name else f"map {self.checksum}"

    def differs(self, other: MapId) -> bool:
        """Return whether both are maps, and not the same."""
        return bool(self.checksum and other.checksum) and self.checksum != other.checksum


NO_MAP = MapId()


def checksum_of(grid: GridMap) -> str:
    """Return eight hexadecimal digits of a map's cells, resolution and origin (CRC-32).

    A map has the same in a file and in a message, which rounds the resolution to 32 bits.
    """
    x, y = (round(number, _DECIMALS) + 0.0 for number in grid.origin[:2])  # no -0.0
    head = struct.pack("<2If2d", *grid.cells.shape, grid.resolution, x, y)
    return f"{zlib.crc32(grid.cells.tobytes(), zlib.crc32(head)):08x}"
