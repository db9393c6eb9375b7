# SPDX-License-Identifier: BSD-3-Clause
"""Reads a map in map_server's format into a `GridMap`, for planning without ROS.

Only what the maps of this repository use: binary PGM (P5) with 8 bit, trinary mode. A running
system gets its map from the topic `map` instead.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from hive_common.checked_yaml import read_checked
from hive_common.errors import FileError
from hive_common.grid_map import GridMap

if TYPE_CHECKING:
    from pathlib import Path

_NUMBER = {"type": "number", "description": "a number"}
_SCHEMA: dict[str, Any] = {
    "type": "object",
    "required": ["image", "resolution", "origin"],
    "properties": {
        "image": {"type": "string", "description": "the name of a .pgm file"},
        "resolution": {"type": "number", "exclusiveMinimum": 0, "description": "above 0 [m]"},
        "origin": {"type": "array", "minItems": 2, "items": _NUMBER, "description": "[x, y, yaw]"},
        "negate": {"enum": [0, 1], "description": "0 or 1"},
        "free_thresh": {"type": "number", "minimum": 0, "maximum": 1, "description": "0 to 1"},
    },
    "description": "map_server's keys image, resolution, origin, negate, free_thresh",
}


def read_map(path: Path) -> GridMap:
    """Read a map.

    Args:
        path: The yaml file that names the image.

    Returns:
        The map; cells that are not known to be free are blocked.

    Raises:
        FileError: A file is missing or not as map_server writes it.
    """
    content = read_checked(path, _SCHEMA)
    image = _read_pgm(path.parent / content["image"])
    occupied = image / 255.0 if content.get("negate", 0) else (255.0 - image) / 255.0
    blocked = occupied >= content.get("free_thresh", 0.196)
    x, y = content["origin"][:2]
    return GridMap(np.flipud(blocked), float(content["resolution"]), (float(x), float(y)))


def _read_pgm(path: Path) -> Any:  # noqa: ANN401  (an array of 8-bit pixels)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}; check the name") from None
    header = re.match(rb"P5\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s+255\s", data)
    if header is None:
        raise FileError(f"{path}: not an 8-bit binary PGM (P5) image; save the map as one")
    width, height = int(header[1]), int(header[2])
    pixels = np.frombuffer(data, dtype=np.uint8, offset=header.end())
    if pixels.size < width * height:
        raise FileError(f"{path}: the image ends early; save the map again")
    return pixels[: width * height].reshape(height, width)
