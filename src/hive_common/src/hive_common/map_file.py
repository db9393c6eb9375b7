# SPDX-License-Identifier: BSD-3-Clause
"""Maps in map_server's format: `<name>.yaml` with the figures, `<name>.pgm` with the cells.

What the keys and the three modes mean is map_server's own definition:

- `trinary`, what map_saver writes: every cell is free, occupied or unknown.
- `scale`: between the two thresholds, how occupied a cell is goes from 1 to 99; transparent
  pixels are unknown.
- `raw`: a pixel's value is the cell's, 0..100; anything above is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import PIL.Image

from hive_common.checked_yaml import read_checked
from hive_common.errors import MapError
from hive_common.pose import Pose
from hive_common.resources import find_file

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

FREE = 0
OCCUPIED = 100
UNKNOWN = -1

FORMATS = ("pgm", "png")
"""Images that a map can be written as; any that PIL knows can be read."""

MAX_CELLS = 25_000_000
"""More cells than that are most likely a mistake in the resolution: 250 m x 250 m at 0.05 m."""

COARSEST = 10.0
"""A larger cell is no map of anything that robots drive through [m]."""

_RAW_MOST = 100
_FREE_PIXEL = 254
_OCCUPIED_PIXEL = 0
_UNKNOWN_PIXEL = 205
_OCCUPIED_THRESH = 0.65
_FREE_THRESH = 0.196

_SHARE = {
    "type": "number",
    "minimum": 0,
    "maximum": 1,
    "description": "how dark a cell is, from 0 (white) to 1 (black)",
}
_SCHEMA: dict[str, Any] = {
    "type": "object",
    "properties": {
        "image": {"type": "string", "minLength": 1, "description": "the name of an image file"},
        "resolution": {
            "type": "number",
            "exclusiveMinimum": 0,
            "maximum": COARSEST,
            "description": f"the size of a cell [m], above 0 and at most {COARSEST:g}",
        },
        "origin": {
            "type": "array",
            "minItems": 3,
            "maxItems": 3,
            "items": {"type": "number", "description": "a number"},
            "description": "[x, y, yaw] of the lower left corner [m, m, rad]",
        },
        "negate": {"enum": [0, 1], "description": "0, or 1 if white means occupied"},
        "occupied_thresh": _SHARE,
        "free_thresh": _SHARE,
        "mode": {"enum": ["trinary", "scale", "raw"], "description": "trinary, scale or raw"},
    },
    "required": ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"],
    "additionalProperties": False,
    "description": "image, resolution, origin, negate, occupied_thresh, free_thresh, mode",
}


@dataclass(frozen=True)
class GridMap:
    """What robots know of a world.

    Attributes:
        cells: (height, width) of UNKNOWN, or FREE 0 to OCCUPIED 100; row 0 is the lowest.
        resolution: Size of a cell [m].
        origin: Where the lower left corner of cell [0, 0] is, frame map [m, m, rad].
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose


def load_map(name_or_path: str) -> GridMap:
    """Read and check a map.

    Args:
        name_or_path: The name of a map of `simenv` (`lab`), or the path of a YAML file.

    Raises:
        FileError: There is no such map, or its YAML file cannot be read or used.
        MapError: Its image cannot be used.
    """
    path = find_file("simenv", "maps", name_or_path)
    keys = read_checked(path, _SCHEMA)
    if keys["free_thresh"] >= keys["occupied_thresh"]:
        raise MapError(
            f"{path}: free_thresh {keys['free_thresh']} is not below occupied_thresh "
            f"{keys['occupied_thresh']}; usual are {_FREE_THRESH} and {_OCCUPIED_THRESH}"
        )
    pixels, opaque = _read_pixels(path.parent / keys["image"])
    cells = _cells(pixels, keys)
    if keys.get("mode") == "scale":
        cells[~opaque] = UNKNOWN
    return GridMap(cells[::-1].copy(), float(keys["resolution"]), Pose(*keys["origin"]))


def _cells(pixels: NDArray[np.uint8], keys: dict[str, Any]) -> NDArray[np.int8]:
    """Return what pixels (height, width) say of their cells."""
    mode = keys.get("mode", "trinary")
    if mode == "raw":
        return np.where(pixels <= _RAW_MOST, pixels, UNKNOWN).astype(np.int8)
    dark = pixels / 255.0 if keys["negate"] else 1.0 - pixels / 255.0
    cells = np.full(pixels.shape, UNKNOWN, dtype=np.int8)
    if mode == "scale":
        low, high = keys["free_thresh"], keys["occupied_thresh"]
        cells = (1 + 98 * (dark - low) / (high - low)).clip(1, 99).astype(np.int8)
    cells[dark > keys["occupied_thresh"]] = OCCUPIED
    cells[dark < keys["free_thresh"]] = FREE
    return cells


def _read_pixels(path: Path) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return an image's brightness (height, width), 0..255, top row first, and what is opaque."""
    try:
        with PIL.Image.open(path) as image:
            if image.width * image.height > MAX_CELLS:
                raise MapError(
                    f"{path}: {image.width} x {image.height} cells are more than "
                    f"{MAX_CELLS:,}; use a coarser resolution"
                )
            if image.mode.startswith("I") or image.mode == "F":
                raise MapError(f"{path}: has more than 8 bits a pixel; save it as 8-bit grey")
            opaque = np.asarray(image.convert("RGBA"))[:, :, 3] > 0
            return np.asarray(image.convert("L")), opaque
    except PIL.UnidentifiedImageError:
        raise MapError(f"{path}: is no image that can be read; a .pgm or .png is needed") from None
    except PIL.Image.DecompressionBombError:
        raise MapError(f"{path}: has too many cells; use a coarser resolution") from None
    except OSError as error:
        reason = error.strerror or "is cut off or damaged"
        raise MapError(f"{path}: cannot be read: {reason}; check the key `image`") from None
    except ValueError:  # what PIL says of a .pgm that ends early, and Python of an impossible name
        raise MapError(
            f"{str(path)!r}: cannot be read: is cut off or damaged; check the key `image`"
        ) from None


def decided(grid: GridMap, free: int, occupied: int) -> GridMap:
    """Return a map whose cells are free, occupied or unknown, and nothing in between.

    Args:
        grid: A map whose cells may be anything from FREE to OCCUPIED.
        free: Cells up to this are free [0..100].
        occupied: Cells from this on are occupied [0..100].
    """
    cells = np.full(grid.cells.shape, UNKNOWN, dtype=np.int8)
    cells[(grid.cells != UNKNOWN) & (grid.cells <= free)] = FREE
    cells[grid.cells >= occupied] = OCCUPIED
    return GridMap(cells, grid.resolution, grid.origin)


def save_map(grid: GridMap, path: Path, kind: str = "pgm") -> None:
    """Write a map as `<path>.yaml` and `<path>.pgm`, as map_saver does.

    Args:
        grid: The map; cells that are neither free nor surely occupied are written as unknown.
        path: The two files' path without suffix.
        kind: Out of `FORMATS`.

    Raises:
        MapError: They cannot be written.
    """
    if path.name in {"", ".."}:
        raise MapError(f"'{path}' is a folder; name the map's files in it, without .yaml")
    pixels = np.full(grid.cells.shape, _UNKNOWN_PIXEL, dtype=np.uint8)
    pixels[grid.cells == FREE] = _FREE_PIXEL
    pixels[grid.cells == OCCUPIED] = _OCCUPIED_PIXEL
    text = (
        f"image: {path.name}.{kind}\n"
        f"resolution: {grid.resolution:g}        # size of a cell [m]\n"
        f"origin: [{grid.origin.x:g}, {grid.origin.y:g}, {grid.origin.yaw:g}]        "
        "# x, y, yaw of the lower left corner, frame map [m, m, rad]\n"
        "negate: 0               # 0: dark means occupied\n"
        f"occupied_thresh: {_OCCUPIED_THRESH}   # darker cells are occupied [0..1]\n"
        f"free_thresh: {_FREE_THRESH}      # brighter cells are free, others unknown [0..1]\n"
    )
    try:
        PIL.Image.fromarray(pixels[::-1]).save(path.with_name(f"{path.name}.{kind}"))
        path.with_name(f"{path.name}.yaml").write_text(text, encoding="utf-8")
    except OSError as error:
        raise MapError(f"{path}: cannot be written: {error.strerror}") from None
