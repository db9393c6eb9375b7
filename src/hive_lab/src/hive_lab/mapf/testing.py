# SPDX-License-Identifier: BSD-3-Clause
"""Small roadmaps and robots for tests of the joint planner."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hive_navigation.mapf.joint_planner import Agent
from hive_navigation.mapf.roadmap import Roadmap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_navigation.mapf.joint_planner import Timetable

CELL = 1.2  # [m]
NEXT = ((0, 1), (0, -1), (1, 0), (-1, 0))


def grid_map(
    rows: Sequence[str],
    steps: Sequence[tuple[int, int]] = NEXT,
    cell: float = CELL,
    stop: NDArray[np.bool_] | None = None,
    park: NDArray[np.bool_] | None = None,
) -> tuple[Roadmap, dict[tuple[int, int], int]]:
    """Return the roadmap of a map drawn with characters, and its places by row and column.

    Args:
        rows: `.` is free.
        steps: Which cells are joined by a lane: rows and columns to the next.
        cell: Their side [m].
        stop: Where a robot may stop; everywhere by default.
        park: Where it may park; everywhere by default.
    """
    cells = [(y, x) for y, row in enumerate(rows) for x, c in enumerate(row) if c == "."]
    number = {cell: k for k, cell in enumerate(cells)}
    pairs = [
        (number[y, x], number[y + dy, x + dx])
        for y, x in cells
        for dy, dx in steps
        if (y + dy, x + dx) in number and (y, x + dx) in number and (y + dy, x) in number
    ]
    lanes = np.array(sorted(pairs), dtype=np.intp)
    places = np.array([(x * cell, y * cell) for y, x in cells])
    wide = np.full(len(lanes), math.inf)
    everywhere = np.ones(len(places), dtype=bool)
    roadmap = Roadmap(
        places=places,
        room=np.full(len(places), math.inf),
        lanes=lanes,
        begins=np.searchsorted(lanes[:, 0], np.arange(len(places) + 1)),
        lengths=np.hypot(*(places[lanes[:, 1]] - places[lanes[:, 0]]).T),
        widths=wide,
        speeds=wide,
        may_stop=everywhere if stop is None else stop,
        may_park=everywhere if park is None else park,
    )
    return roadmap, number


def robot(
    start: int,
    goal: int,
    radius: float = 0.3,
    speed: float = 1.0,
    heading: float = 0.0,
    priority: float = 0.0,
    ready: float = 0.0,
    stays: bool = False,
) -> Agent:
    """Return a robot; see `Agent`."""
    return Agent(start, ready, heading, goal, radius, speed, 0.8, 1.5, priority, stays)


def where(roadmap: Roadmap, table: Timetable, time: float) -> Array:
    """Return where a robot is at some time; it drives evenly along each lane."""
    for k, place in enumerate(table.places):
        if time <= table.leaves[k]:
            if k == 0 or time >= table.arrives[k]:
                return np.asarray(roadmap.places[place])
            begin, end = table.leaves[k - 1], table.arrives[k]
            one, other = roadmap.places[table.places[k - 1]], roadmap.places[place]
            return np.asarray(one + (other - one) * (time - begin) / (end - begin))
    raise AssertionError("a robot stands at its last place for ever")


def nearest(
    roadmap: Roadmap, agents: Sequence[Agent], tables: Sequence[Timetable], step: float = 0.05
) -> float:
    """Return the least room between two robots' circles at any time [m]."""
    end = max(table.arrives[-1] for table in tables) + 1.0
    least = math.inf
    for time in np.arange(0.0, end, step):
        at = [where(roadmap, table, time) for table in tables]
        for i, j in itertools.combinations(range(len(agents)), 2):
            gap = math.dist(at[i], at[j]) - agents[i].radius - agents[j].radius
            least = min(least, gap)
    return least
