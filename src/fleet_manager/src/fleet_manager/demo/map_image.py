# SPDX-License-Identifier: BSD-3-Clause
"""Reads a map in map_server's format, for drawing on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from hive_common.checked_yaml import read_checked

if TYPE_CHECKING:
    from pathlib import Path

_SCHEMA: dict[str, Any] = {
    "type": "object",
    "required": ["image", "resolution", "origin"],
    "properties": {
        "image": {"type": "string", "description": "the name of an image file"},
        "resolution": {
            "type": "number",
            "exclusiveMinimum": 0,
            "description": "metres per cell, over 0",
        },
        "origin": {
            "type": "array",
            "minItems": 3,
            "maxItems": 3,
            "items": {"type": "number"},
            "description": "[x, y, yaw] of the lower left corner [m, m, rad]",
        },
    },
}


@dataclass(frozen=True)
class MapImage:
    """A map as a picture.

    Attributes:
        grey: (rows, columns) array, 0 black (occupied) to 255 white (free), upper row first.
        extent: Left, right, bottom, top edge in the map frame [m].
    """

    grey: np.ndarray[Any, np.dtype[np.uint8]]
    extent: tuple[float, float, float, float]


def read_map_image(path: Path) -> MapImage:
    """Read a map.

    Args:
        path: Its YAML file; the image lies beside it.

    Raises:
        hive_common.errors.FileError: The YAML file has a mistake.
        OSError: The image cannot be read.
    """
    content = read_checked(path, _SCHEMA)
    with Image.open(path.parent / content["image"]) as image:
        grey = np.asarray(image.convert("L"))
    x, y, _ = content["origin"]
    rows, columns = grey.shape
    size = float(content["resolution"])
    return MapImage(grey, (x, x + columns * size, y, y + rows * size))
