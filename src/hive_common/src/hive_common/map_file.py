# SPDX-License-Identifier: BSD-3-Clause
"""Maps in map_server's format: `<name>.yaml` with the figures, `<name>.pgm` with the cells.

Keys and modes mean what map_server (ROS Noetic, `image_loader.cpp`) makes of them. A pixel counts
by the mean of its colours, and with `negate` by 255 less that:

- `trinary`, what map_saver writes: every cell is free, occupied or unknown. Opacity is averaged in
  as if it were a colour.
- `scale`: between the two thresholds, occupancy goes from 1 to 99; transparent pixels are unknown
  there.
- `raw`: a pixel's value is the cell's; from 128 on it is stored as a negative number, 256 less.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import attrs
import numpy as np
import PIL.Image
from numpy.typing import NDArray

from hive_common.checked_yaml import read_checked, unknown_keys
from hive_common.errors import MapError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.pose import FARTHEST, MOST_TURNED, Pose
from hive_common.resources import find_file
from hive_common.structuring import Allowed, NotAllowedError, one_of, positive
from hive_common.turned_map import TurnedMap

FORMATS = ("pgm", "png")  # image formats for writing; reading takes any that PIL knows

MAX_CELLS = 25_000_000
"""Maximum size, 250 m x 250 m at 0.05 m; more is almost certainly a wrong resolution."""

COARSEST = 10.0  # maximum size of a cell [m]; robots cannot drive by a coarser map

_FREE_PIXEL = 254
_OCCUPIED_PIXEL = 0
_WITH_ALPHA = 4  # channels of an image with opacity
_UNKNOWN_PIXEL = 205
_OCCUPIED_THRESH = 0.65
_FREE_THRESH = 0.196

_Share = Annotated[
    float, Allowed("how dark a cell is, from 0 (white) to 1 (black)", lambda n: 0 <= n <= 1)
]


@attrs.frozen(kw_only=True)
class MapContent:
    """A map's YAML file, with map_server's keys."""

    OTHER_KEYS = True  # as map_server; whoever reads the file may warn of them

    image: Annotated[str, Allowed("the name of an image file")]
    resolution: Annotated[float, positive("the size of a cell [m]", COARSEST)]
    origin: Annotated[
        Pose,
        Allowed(
            f"[x, y, yaw] of the lower left corner [m, m, rad], at most {FARTHEST / 1000:g} km "
            f"away and turned by at most {MOST_TURNED:g} rad"
        ),
    ]
    negate: Annotated[
        int, Allowed("0, or 1 if white means occupied", lambda value: value in {0, 1})
    ]
    occupied_thresh: _Share
    free_thresh: _Share
    mode: Annotated[str, one_of("trinary", "scale", "raw")] = "trinary"

    def __attrs_post_init__(self) -> None:
        """Refuse thresholds in the wrong order."""
        if self.free_thresh >= self.occupied_thresh:
            raise NotAllowedError(
                ["free_thresh"],
                f"{self.free_thresh:g} is not below occupied_thresh {self.occupied_thresh:g}; "
                f"usual are {_FREE_THRESH} and {_OCCUPIED_THRESH}",
            )


def load_map(name_or_path: str, warn: Callable[[str], None] = lambda _: None) -> GridMap:
    """Read and check a map; where its origin has a yaw, draw it anew (`turned_map`).

    Args:
        name_or_path: The name of a map of `simenv` (`lab`), or the path of a YAML file.
        warn: Called with what is odd about the file and changes nothing.

    Raises:
        FileError: There is no such map, or its YAML file cannot be read or used.
        MapError: Its image cannot be used, or is too large to be drawn anew.
    """
    turned = load_turned_map(name_or_path, warn)
    try:
        return turned.upright()
    except MapError as error:
        raise MapError(f"{find_file('simenv', 'maps', name_or_path)}: {error}") from None


def load_turned_map(name_or_path: str, warn: Callable[[str], None] = lambda _: None) -> TurnedMap:
    """Read and check a map as it is, for whoever passes it on with the yaw of its origin.

    Args:
        name_or_path: As in `load_map`.
        warn: As in `load_map`.

    Raises:
        FileError: There is no such map, or its YAML file cannot be read or used.
        MapError: Its image cannot be used.
    """
    path = find_file("simenv", "maps", name_or_path)
    content = read_checked(path, MapContent)
    for problem in unknown_keys(path, MapContent):
        warn(problem)
    try:
        pixels = _read_pixels(path.parent / content.image)
    except MapError as error:
        raise MapError(f"{path}: image: {error}") from None
    cells = _cells(pixels, content)
    return TurnedMap(cells[::-1].copy(), content.resolution, content.origin)


def _cells(pixels: NDArray[np.uint8], content: MapContent) -> NDArray[np.int8]:
    """Return the cells that pixels (rows, columns, channels) stand for.

    The channels are grey, or red, green and blue, or these and the opacity.
    """
    has_alpha = pixels.shape[2] == _WITH_ALPHA
    counted = pixels[:, :, :-1] if has_alpha and content.mode != "trinary" else pixels
    mean = counted.mean(axis=2)
    bright = 255.0 - mean if content.negate else mean
    if content.mode == "raw":
        signed: NDArray[np.int8] = bright.astype(np.uint8).view(np.int8)
        return signed
    dark = (255.0 - bright) / 255.0
    cells = np.full(dark.shape, UNKNOWN, dtype=np.int8)
    low, high = content.free_thresh, content.occupied_thresh
    if content.mode == "scale":
        cells = (1 + 98 * (dark - low) / (high - low)).clip(1, 99).astype(np.int8)
        if has_alpha:
            cells[pixels[:, :, -1] == 0] = UNKNOWN
    cells[dark > high] = OCCUPIED
    cells[dark < low] = FREE
    return cells


def _read_pixels(path: Path) -> NDArray[np.uint8]:
    """Return an image's pixels (rows, columns, channels), 0..255, top row first; see `_cells`."""
    try:
        with PIL.Image.open(path) as image:
            if image.width * image.height > MAX_CELLS:
                raise MapError(
                    f"{path}: {image.width} x {image.height} cells are more than "
                    f"{MAX_CELLS:,}; use a coarser resolution"
                )
            if image.mode.startswith("I") or image.mode == "F":
                raise MapError(f"{path}: has more than 8 bits a pixel; save it as 8-bit grey")
            kind = "L" if image.mode in {"1", "L"} else "RGB"
            if "A" in image.getbands() or "transparency" in image.info:
                kind = "RGBA"
            pixels: NDArray[np.uint8] = np.atleast_3d(np.asarray(image.convert(kind)))
            return pixels
    except PIL.UnidentifiedImageError:
        raise MapError(f"{path}: is not a readable image; a .pgm or .png is needed") from None
    except PIL.Image.DecompressionBombError:
        raise MapError(f"{path}: has too many cells; use a coarser resolution") from None
    except OSError as error:
        reason = error.strerror or "is cut off or damaged"
        raise MapError(f"{path}: cannot be read: {reason}") from None
    except ValueError:  # PIL raises it for a .pgm that ends early, Python for an impossible name
        raise MapError(f"{str(path)!r}: cannot be read: is cut off or damaged") from None


def save_map(grid: GridMap, path: Path, kind: str = "pgm") -> None:
    """Write a map as `<path>.yaml` and `<path>.pgm`, as map_saver does.

    Args:
        grid: The map; cells that are neither FREE nor OCCUPIED become unknown.
        path: Of both files, without suffix.
        kind: One of `FORMATS`.

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
