# SPDX-License-Identifier: BSD-3-Clause
"""Maps in map_server's format: `<name>.yaml` with the figures, `<name>.pgm` with the cells.

Only the mode `trinary` is read, the one that map_saver writes: every cell is free, occupied or
unknown. What the keys mean is map_server's own definition.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import PIL.Image

from robot_description.checked_yaml import read_checked
from robot_description.follower import Pose
from simenv.errors import MapError
from simenv.folders import file_names, named_file

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

FREE = 0
OCCUPIED = 100
UNKNOWN = -1

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
            "maximum": 10,
            "description": "the size of a cell [m], above 0 and at most 10",
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
        "mode": {"const": "trinary", "description": "trinary, or no mode at all"},
    },
    "required": ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"],
    "additionalProperties": False,
    "description": "image, resolution, origin, negate, occupied_thresh, free_thresh, mode",
}


@dataclass(frozen=True)
class GridMap:
    """What robots know of a world.

    Attributes:
        cells: (height, width) of FREE, OCCUPIED or UNKNOWN; row 0 is the lowest.
        resolution: Size of a cell [m].
        origin: Where the lower left corner of cell [0, 0] is, frame map [m, m, rad].
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: Pose


def load_map(name_or_path: str) -> GridMap:
    """Read and check a map.

    Args:
        name_or_path: The name of a map of this package (`lab`), or the path of a YAML file.

    Raises:
        FileError: The YAML file cannot be read, or holds something that is not allowed.
        MapError: There is no such map, or its image cannot be used.
    """
    path = named_file("maps", name_or_path)
    if path is None:
        raise MapError(
            f"map '{name_or_path}': not known; allowed: {', '.join(file_names('maps'))}, "
            "or the path of a .yaml file"
        )
    keys = read_checked(path, _SCHEMA)
    if keys["free_thresh"] >= keys["occupied_thresh"]:
        raise MapError(
            f"{path}: free_thresh {keys['free_thresh']} is not below occupied_thresh "
            f"{keys['occupied_thresh']}; usual are {_FREE_THRESH} and {_OCCUPIED_THRESH}"
        )
    pixels = _read_pixels(path.parent / keys["image"])
    dark = pixels / 255.0 if keys["negate"] else 1.0 - pixels / 255.0
    cells = np.full(pixels.shape, UNKNOWN, dtype=np.int8)
    cells[dark > keys["occupied_thresh"]] = OCCUPIED
    cells[dark < keys["free_thresh"]] = FREE
    return GridMap(cells[::-1].copy(), float(keys["resolution"]), Pose(*keys["origin"]))


def _read_pixels(path: Path) -> NDArray[np.uint8]:
    """Return the brightness of an image (height, width), 0..255, top row first."""
    try:
        with PIL.Image.open(path) as image:
            return np.asarray(image.convert("L"))
    except PIL.UnidentifiedImageError:
        raise MapError(f"{path}: is no image that can be read; a .pgm or .png is needed") from None
    except PIL.Image.DecompressionBombError:
        raise MapError(f"{path}: has too many cells; use a coarser resolution") from None
    except OSError as error:
        reason = error.strerror or "is cut off or damaged"
        raise MapError(f"{path}: cannot be read: {reason}; check the key `image`") from None


def save_map(grid: GridMap, path: Path) -> None:
    """Write a map as `<path>.yaml` and `<path>.pgm`.

    Args:
        grid: The map.
        path: The two files' path without suffix.

    Raises:
        MapError: They cannot be written.
    """
    pixels = np.full(grid.cells.shape, _UNKNOWN_PIXEL, dtype=np.uint8)
    pixels[grid.cells == FREE] = _FREE_PIXEL
    pixels[grid.cells == OCCUPIED] = _OCCUPIED_PIXEL
    text = (
        f"image: {path.name}.pgm\n"
        f"resolution: {grid.resolution:g}        # size of a cell [m]\n"
        f"origin: [{grid.origin.x:g}, {grid.origin.y:g}, {grid.origin.yaw:g}]        "
        "# x, y, yaw of the lower left corner, frame map [m, m, rad]\n"
        "negate: 0               # 0: dark means occupied\n"
        f"occupied_thresh: {_OCCUPIED_THRESH}   # darker cells are occupied [0..1]\n"
        f"free_thresh: {_FREE_THRESH}      # brighter cells are free, others unknown [0..1]\n"
    )
    try:
        PIL.Image.fromarray(pixels[::-1]).save(path.with_name(f"{path.name}.pgm"))
        path.with_name(f"{path.name}.yaml").write_text(text, encoding="utf-8")
    except OSError as error:
        raise MapError(f"{path}: cannot be written: {error.strerror}") from None
