# SPDX-License-Identifier: BSD-3-Clause
"""Reads the benchmark's files: maps, scenarios, and the places of pickup and delivery.

The formats are those of the movingai benchmark (Stern et al., Multi-Agent Pathfinding:
Definitions, Variants, and Benchmarks, SoCS 2019). A cell is (column, row), both from 0, with
(0, 0) in the upper left corner. A bad file is refused in one line: file, line, what is allowed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.errors import FileError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from hive_common.geometry import Indices

FREE = ".GS"  # ground and swamp
BLOCKED = "@OTW"  # out of bounds, trees and water
TASK = "s"  # where something is picked up or delivered
PARKING = "e"  # where a robot may stay
PLAIN = "."

_MOST_SIDE = 4096  # cells; a larger map needs more memory than a benchmark should
_FIELDS = "bucket, map, width, height, start x, start y, goal x, goal y, length"


class Cell(NamedTuple):
    """A cell of a grid."""

    column: int
    row: int


@dataclass(frozen=True)
class Grid:
    """Which cells are free.

    Attributes:
        free: (height, width) array.
    """

    free: NDArray[np.bool_]

    @cached_property
    def numbers(self) -> Indices:
        """(height, width) array: the number of each free cell, counted row by row; else -1."""
        counted: Indices = np.where(self.free, np.cumsum(self.free).reshape(self.free.shape), 0)
        return counted - 1

    @cached_property
    def cells(self) -> Indices:
        """(n, 2) array: column and row of each free cell by its number."""
        rows, columns = np.nonzero(self.free)
        return np.column_stack([columns, rows])

    def number(self, cell: Cell) -> int:
        """Return the number of a free cell."""
        return int(self.numbers[cell.row, cell.column])


class Trip(NamedTuple):
    """One robot's part of a scenario."""

    start: Cell
    goal: Cell


@dataclass(frozen=True)
class TaskPlaces:
    """The places of a problem of pickup and delivery, as numbers of free cells.

    Attributes:
        task: Where something is picked up or delivered.
        parking: Where robots start, and may stay.
    """

    task: Indices
    parking: Indices


def read_map(path: Path) -> Grid:
    """Read a `.map` file.

    Raises:
        FileError: It cannot be read, or holds something that is not allowed.
    """
    lines = _lines(path)
    size: dict[str, int] = {}
    for number, line in enumerate(lines, start=1):
        key, *words = line.split() or [""]
        if key == "map" and not words:
            break
        if key not in {"type", "height", "width"} or len(words) != 1:
            raise FileError(
                f"{path}:{number}: {line!r}; allowed before the line `map`: `type NAME`, "
                "`height N`, `width N`"
            )
        if key != "type":
            size[key] = _whole(path, number, key, words[0], 1, _MOST_SIDE)
    else:
        raise FileError(f"{path}:{len(lines) + 1}: the file ends before a line `map`")
    for key in ("height", "width"):
        if key not in size:
            raise FileError(f"{path}:{number}: `{key} N` must come before `map`")
    rows = _rows(path, lines, number, (size["height"], size["width"]), FREE + BLOCKED)
    return Grid(np.isin(rows, list(FREE)))


def read_task_places(path: Path, grid: Grid) -> TaskPlaces:
    """Read a file of places of pickup and delivery that belongs to a map.

    It holds a letter for each cell and no header: `s` task, `e` parking, `.` or a letter for what
    is blocked.

    Raises:
        FileError: It cannot be read, does not fit the map, or has too few places.
    """
    lines = _lines(path)
    rows = _rows(path, lines, 0, grid.free.shape, TASK + PARKING + PLAIN + BLOCKED)
    for letter in (TASK, PARKING):
        blocked = np.argwhere((rows == letter) & ~grid.free)
        if len(blocked):
            row, column = blocked[0]
            raise FileError(
                f"{path}:{row + 1}: `{letter}` in column {column + 1} is where the map is "
                "blocked; allowed: a free cell"
            )
    task, parking = (grid.numbers[rows == letter] for letter in (TASK, PARKING))
    if len(task) <= 1 or not len(parking):
        raise FileError(
            f"{path}: {len(task)} places `{TASK}` and {len(parking)} places `{PARKING}`; needed: "
            "two and one at least"
        )
    return TaskPlaces(task, parking)


def read_scenario(path: Path, grid: Grid) -> tuple[Trip, ...]:
    """Read a `.scen` file that belongs to a map.

    Raises:
        FileError: It cannot be read, or holds something that is not allowed.
    """
    lines = _lines(path)
    if not lines or lines[0].split()[:1] != ["version"]:
        raise FileError(f"{path}:1: {lines[0] if lines else ''!r}; allowed: `version 1`")
    trips = []
    for number, line in enumerate(lines[1:], start=2):
        if line.strip():
            trips.append(_trip(path, number, line, grid))
    return tuple(trips)


def _trip(path: Path, number: int, line: str, grid: Grid) -> Trip:
    words = line.split()
    if len(words) != len(_FIELDS.split(",")):
        raise FileError(f"{path}:{number}: {len(words)} fields; allowed: nine: {_FIELDS}")
    height, width = grid.free.shape
    names = ("start x", "start y", "goal x", "goal y")
    limits = (width, height, width, height)
    x, y, goal_x, goal_y = (
        _whole(path, number, name, word, 0, limit - 1)
        for name, word, limit in zip(names, words[4:8], limits, strict=True)
    )
    trip = Trip(Cell(x, y), Cell(goal_x, goal_y))
    for name, cell in zip(trip._fields, trip, strict=True):
        if not grid.free[cell.row, cell.column]:
            raise FileError(
                f"{path}:{number}: the {name} ({cell.column}, {cell.row}) is blocked; allowed: a "
                "free cell of the map"
            )
    return trip


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="ascii").splitlines()
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}; check the name") from None
    except UnicodeDecodeError:
        raise FileError(f"{path}: is not a text file of ASCII letters") from None


def _whole(path: Path, number: int, name: str, word: str, least: int, most: int) -> int:
    """Return a whole number that a file holds."""
    if not word.isdecimal() or not least <= int(word) <= most:
        raise FileError(
            f"{path}:{number}: {name} is {word!r}; allowed: a whole number from {least} to {most}"
        )
    return int(word)


def _rows(
    path: Path, lines: list[str], begin: int, shape: tuple[int, ...], letters: str
) -> NDArray[np.str_]:
    """Return the letters (height, width) that follow the first `begin` lines."""
    height, width = shape
    body = lines[begin:]
    while body and not body[-1].strip():
        body.pop()
    if len(body) != height:
        raise FileError(
            f"{path}:{begin + len(body)}: {len(body)} rows of cells; allowed: {height}, the height"
        )
    for number, row in enumerate(body, start=begin + 1):
        if len(row) != width:
            raise FileError(f"{path}:{number}: {len(row)} cells; allowed: {width}, the width")
        strange = next((letter for letter in row if letter not in letters), None)
        if strange is not None:
            raise FileError(f"{path}:{number}: {strange!r}; allowed: {' '.join(letters)}")
    return np.array([list(row) for row in body])
