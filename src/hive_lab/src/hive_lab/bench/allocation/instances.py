# SPDX-License-Identifier: BSD-3-Clause
"""The seeded instances: robots and tasks at random places of the warehouse.

Starts and ends are uniform over the free cells of the map. Robots drive at 1 m/s, so a length in
metres is a time in seconds.

`python -m hive_lab.bench.allocation.instances FOLDER` exports them for other solvers.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.grid_path_lengths import GridPathLengths
from hive_common.distances import distances
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.allocation.instance import Instance

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

RADIUS = 0.3  # of every robot [m]

KINDS = ("bring", "go")
"""Pick and bring (from a start to an end), and go there (both are one place)."""


@dataclass(frozen=True)
class Size:
    """A size of instances; `seeds` is their number, `seconds` the search's processor time [s]."""

    robots: int
    tasks: int
    seeds: int
    seconds: float

    @property
    def name(self) -> str:
        """Robots x tasks."""
        return f"{self.robots}x{self.tasks}"


SIZES = (Size(3, 10, 10, 0.1), Size(4, 20, 6, 0.2), Size(20, 100, 3, 1.0), Size(100, 1000, 1, 1.5))


class Floor:
    """The free places of the warehouse, and the distances between them."""

    def __init__(self) -> None:
        self._grid = load_map("warehouse")
        step = self._grid.resolution
        apart = [cells * step for _, cells in distances(self._grid.blocked, RADIUS / step + 1)]
        self._cells = np.argwhere(np.concatenate(apart) > RADIUS)
        self.path_lengths = GridPathLengths(self._grid, RADIUS)

    def own_path_lengths(self) -> GridPathLengths:
        """Return path lengths with an empty cache, as in a process of its own."""
        return GridPathLengths(self._grid, RADIUS)

    def places(self, random: np.random.Generator, number: int) -> list[Pose]:
        """Return the centres of random free cells, frame map."""
        chosen = self._cells[random.integers(len(self._cells), size=number)] + 0.5
        side, (x, y, _) = self._grid.resolution, self._grid.origin
        return [Pose(x + column * side, y + row * side) for row, column in chosen]


@dataclass(frozen=True)
class Places:
    """One drawing of places, frame map.

    Attributes:
        ways: (ends, starts and robots, starts) path lengths [m].
    """

    robots: list[Pose]
    starts: list[Pose]
    ends: list[Pose]
    ways: NDArray[np.float64]

    @classmethod
    def draw(cls, floor: Floor, robots: int, tasks: int, seed: Sequence[int]) -> Places:
        """Draw places of robots, and of the starts and ends of tasks."""
        random = np.random.default_rng(seed)
        where = floor.places(random, robots)
        starts = floor.places(random, tasks)
        ends = floor.places(random, tasks)
        ways = floor.path_lengths.lengths([*ends, *starts, *where], starts)
        return cls(where, starts, ends, ways)

    def part(self, robots: int, tasks: int) -> Places:
        """Return the first robots and tasks of the drawing."""
        whole = len(self.starts)
        rows = np.concatenate(
            [np.arange(tasks), whole + np.arange(tasks), 2 * whole + np.arange(robots)]
        )
        return Places(
            self.robots[:robots],
            self.starts[:tasks],
            self.ends[:tasks],
            self.ways[np.ix_(rows, np.arange(tasks))],
        )

    @property
    def table(self) -> tuple[list[Pose], int, NDArray[np.float64]]:
        """Return all places, the number of the first that are goals, and their lengths [m]."""
        tasks = len(self.starts)
        from_end, from_start, from_robot = np.split(self.ways, [tasks, 2 * tasks])
        lengths = np.concatenate([from_start, from_end, from_robot])
        return [*self.starts, *self.ends, *self.robots], tasks, lengths

    def instance(self, kind: str) -> Instance:
        """Return the instance of a kind; the kinds share their places."""
        tasks = len(self.starts)
        from_end, from_start, from_robot = np.split(self.ways, [tasks, 2 * tasks])
        after = {"bring": from_end, "go": from_start}[kind]
        return Instance.plain(np.concatenate([after, from_robot]), after.diagonal())


def places(size: Size, floor: Floor) -> Iterator[tuple[str, Places]]:
    """Yield the drawings of a size with their names."""
    for seed in range(size.seeds):
        drawn = Places.draw(floor, size.robots, size.tasks, [size.robots, size.tasks, seed])
        yield str(seed), drawn


def instances(size: Size, floor: Floor) -> Iterator[tuple[str, Instance]]:
    """Yield all instances of a size with their names."""
    for seed, drawn in places(size, floor):
        for kind in KINDS:
            yield f"{size.name}/{kind}/{seed}", drawn.instance(kind)


def export(folder: Path) -> None:
    """Write each instance as `<name>.npz` with `way` and `inner`, `/` in its name as `_`."""
    folder.mkdir(parents=True, exist_ok=True)
    floor = Floor()
    for size in SIZES:
        for name, instance in instances(size, floor):
            path = folder / f"{name.replace('/', '_')}.npz"
            np.savez_compressed(path, way=instance.way, inner=instance.tasks.inner)


if __name__ == "__main__":
    export(Path(sys.argv[1]))
