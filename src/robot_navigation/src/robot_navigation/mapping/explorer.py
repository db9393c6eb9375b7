# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot to where the map ends, until it ends nowhere.

It follows Yamauchi, "A frontier-based approach for autonomous exploration", CIRA 1997.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hive_common.map_file import FREE, UNKNOWN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.map_file import GridMap
    from hive_common.pose import Pose

SPARE = 0.08
"""The way keeps so far from things, besides the robot's own radius [m]."""

NEAR = 1.2
"""A frontier is looked at from so near [m]."""

SMALLEST = 6
"""Frontiers of fewer cells are cracks between beams."""

SPEED = 0.5
"""[m/s]"""

COMFORT = 0.3
"""Up to so much more room than it needs, the robot takes a longer way for it [m] ..."""

DETOUR = 3.0
"""... at most so many times longer than where there is no more room."""

AHEAD = 0.35
"""The robot steers for the point of its way so far ahead [m]."""

SHARP = 0.6
"""A robot that is turned away further than this turns on the spot first [rad]."""

TURN = 1.5
"""Turning speed for each radian that the robot is turned away [rad/s]."""

ARRIVED = 0.25
"""[m]"""

STUCK = 0.03
"""A robot that has neither moved so far [m] nor turned so far [rad] between two plans is stuck."""

BACK = -0.15
"""It drives back then, until the next plan [m/s]."""


class Explorer:
    """Decides where a robot that makes a map drives.

    Attributes:
        finished: Whether everything that can be reached has been seen.
    """

    def __init__(self, radius: float, max_speed: float) -> None:
        """Explore with a robot that fits into a circle.

        Args:
            radius: Of that circle [m].
            max_speed: Of the robot [m/s].
        """
        self._radius = radius
        self._speed = min(SPEED, max_speed)
        self._way: Array = np.zeros((0, 2))
        self._given_up: list[tuple[float, float]] = []
        self._last: Pose | None = None
        self._stuck = False
        self.finished = False

    def plan(self, chart: GridMap, here: Pose) -> None:
        """Choose the nearest frontier on the map as it is now, and the way to it.

        Args:
            chart: The map so far.
            here: Where the robot is, frame map.
        """
        self._stuck = self._is_stuck(here)
        self._last = here
        if len(self._way) and math.dist(self._way[-1], here[:2]) < ARRIVED:
            # What is still a frontier after the robot has been there cannot be seen from there.
            self._given_up.append((here.x, here.y))
        goals = self._frontiers(chart)
        room = ndimage.distance_transform_edt(chart.cells == FREE) * chart.resolution
        start = _cell(chart, here[:2])
        open_to = room >= self._radius + SPARE
        # Whoever stands too close to something has to get away from there all the same.
        open_to |= _disc(chart, here[:2], self._radius + SPARE) & (chart.cells == FREE)
        open_to[start] = True
        spare = np.clip((room - self._radius - SPARE) / COMFORT, 0.0, 1.0)
        length, before = _ways(open_to, start, 1.0 + (DETOUR - 1.0) * (1.0 - spare))
        close = ndimage.distance_transform_edt(~goals) * chart.resolution <= NEAR
        length[~(close & open_to)] = np.inf
        self.finished = not np.isfinite(length).any() if goals.any() else True
        self._way = np.zeros((0, 2)) if self.finished else _back(chart, length, before)

    def steer(self, here: Pose) -> tuple[float, float]:
        """Return how to drive now: forward [m/s] and counter-clockwise [rad/s].

        Args:
            here: Where the robot is, frame map.
        """
        if not len(self._way):
            return 0.0, 0.0
        if self._stuck:
            return BACK, 0.0
        away = np.hypot(*(self._way - here[:2]).T)
        nearest = int(np.argmin(away))
        ahead = nearest + int(np.argmax(away[nearest:] >= AHEAD))
        aim = self._way[ahead if away[ahead] >= AHEAD else -1]
        left = math.dist(self._way[-1], here[:2])
        if left < ARRIVED:
            return 0.0, 0.0
        turned = math.remainder(math.atan2(aim[1] - here.y, aim[0] - here.x) - here.yaw, math.tau)
        if abs(turned) > SHARP:
            return 0.0, math.copysign(1.0, turned)
        # Slower in bends and towards the end, where there may be no room for a way to stop.
        return min(self._speed, left) * (1.0 - abs(turned) / SHARP), TURN * turned

    def _is_stuck(self, here: Pose) -> bool:
        """Return whether the robot was to move since the last plan and did not."""
        last = self._last
        if last is None or self._stuck or not len(self._way):
            return False
        turned = abs(math.remainder(here.yaw - last.yaw, math.tau))
        return math.dist(here[:2], last[:2]) < STUCK and turned < STUCK

    def _frontiers(self, chart: GridMap) -> NDArray[np.bool_]:
        """Return the free cells beside unknown ones, small groups and given-up ones left out."""
        unknown = ndimage.binary_dilation(chart.cells == UNKNOWN)
        frontier = (chart.cells == FREE) & unknown
        groups, _ = ndimage.label(frontier, np.ones((3, 3)))
        sizes = np.bincount(groups.ravel())
        frontier &= sizes[groups] >= SMALLEST
        for place in self._given_up:
            frontier &= ~_disc(chart, place, NEAR + 2 * ARRIVED)
        found: NDArray[np.bool_] = frontier
        return found


def _cell(chart: GridMap, point: tuple[float, float]) -> tuple[int, int]:
    x, y = point
    row = int((y - chart.origin.y) / chart.resolution)
    return row, int((x - chart.origin.x) / chart.resolution)


def _disc(chart: GridMap, middle: tuple[float, float], radius: float) -> NDArray[np.bool_]:
    """Return the cells of a disc [m], frame map."""
    row, column = _cell(chart, middle)
    rows, columns = np.ogrid[: chart.cells.shape[0], : chart.cells.shape[1]]
    inside: NDArray[np.bool_] = np.hypot(rows - row, columns - column) <= radius / chart.resolution
    return inside


def _ways(
    open_to: NDArray[np.bool_], start: tuple[int, int], weight: Array
) -> tuple[Array, NDArray[np.int32]]:
    """Return, for every cell, how long the way there is [cells] and the cell before it.

    Args:
        open_to: Cells that the robot's middle may be in.
        start: Row and column of where it is.
        weight: By what the way through a cell is longer than it is.
    """
    rows, columns = open_to.shape
    number = np.arange(open_to.size).reshape(open_to.shape)
    ends, weights = [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = (slice(0, rows - down), slice(max(0, -right), columns - max(0, right)))
        b = (slice(down, rows), slice(max(0, right), columns + min(0, right)))
        both = open_to[a] & open_to[b]
        ends.append(np.stack([number[a][both], number[b][both]]))
        weights.append(math.hypot(down, right) * (weight[a][both] + weight[b][both]) / 2)
    pairs = np.concatenate(ends, axis=1)
    graph = sparse.coo_matrix((np.concatenate(weights), pairs), shape=(open_to.size,) * 2)
    length, before = csgraph.dijkstra(
        graph.tocsr(), directed=False, indices=number[start], return_predecessors=True
    )
    return length.reshape(open_to.shape), before.reshape(open_to.shape)


def _back(chart: GridMap, length: Array, before: NDArray[np.int32]) -> Array:
    """Return the way (n, 2) to the cell with the least length, frame map [m]."""
    columns = length.shape[1]
    cell = int(np.argmin(length))
    way = []
    while cell >= 0:
        way.append((cell % columns, cell // columns))
        cell = int(before.flat[cell])
    points: Array = (np.array(way[::-1]) + 0.5) * chart.resolution
    return points + chart.origin[:2]
