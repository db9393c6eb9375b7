# SPDX-License-Identifier: BSD-3-Clause
"""Drives a robot to the frontiers of its map until there are none left.

It follows Yamauchi, "A frontier-based approach for autonomous exploration", CIRA 1997.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hive_common.grid_map import FREE, UNKNOWN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose

MARGIN = 0.08  # clearance beyond the robot's radius that a path must keep [m]
NEAR = 1.2  # distance from which the robot observes a frontier [m]
MIN_FRONTIER = 6  # frontiers of fewer cells are cracks between beams
SPEED = 0.5  # [m/s]
COMFORT = 0.3  # the robot takes a longer path to gain up to this much clearance more [m] ...
DETOUR = 3.0  # ... of at most this many times the length
AHEAD = 0.35  # the robot steers for the point of its path this far ahead [m]
SHARP = 0.6  # with a larger heading error the robot turns on the spot first [rad]
TURN = 1.5  # yaw rate per heading error [rad/s per rad]
ARRIVED = 0.25  # distance from the end of the path that counts as arrived [m]
TINY = 1e-3  # the least age that counts [s]
STUCK = 0.03  # a robot that moves and turns less than this between two plans is stuck [m], [rad]
BACK = -0.15  # speed of a stuck robot until the next plan [m/s]: it backs off ...
BACK_FAR = 0.3  # ... this far at most [m]; on a busy machine the next plan may take long


class Explorer:
    """Chooses where a mapping robot drives."""

    def __init__(self, radius: float, max_speed: float) -> None:
        """Explore with a robot of a radius [m] and a top speed [m/s]."""
        self._radius = radius
        self._speed = min(SPEED, max_speed)
        self._path: Array = np.zeros((0, 2))
        self._given_up: list[tuple[float, float]] = []
        self._last: Pose | None = None
        self._stuck = False
        self._chart: GridMap | None = None
        self._room: Array = np.zeros((0, 0))  # of every cell of it, to what is not free [m]
        self.finished = False  # whether the map shows everything that the robot can reach

    def plan(self, chart: GridMap, here: Pose) -> None:
        """Choose the nearest frontier on the map so far, and the path to it; `here`: frame map."""
        self._stuck = self._is_stuck(here)
        self._last = here
        if len(self._path) and math.dist(self._path[-1], here[:2]) < ARRIVED:
            # A frontier that remains cannot be observed from here.
            self._given_up.append((here.x, here.y))
        goals = self._frontiers(chart)
        room = ndimage.distance_transform_edt(chart.cells == FREE) * chart.resolution
        self._chart, self._room = chart, room
        start = _cell(chart, here[:2])
        open_to = room >= self._radius + MARGIN
        # A robot that stands too close to an obstacle must get away nevertheless.
        open_to |= _disc(chart, here[:2], self._radius + MARGIN) & (chart.cells == FREE)
        open_to[start] = True
        spare = np.clip((room - self._radius - MARGIN) / COMFORT, 0.0, 1.0)
        length, before = _paths(open_to, start, 1.0 + (DETOUR - 1.0) * (1.0 - spare))
        close = ndimage.distance_transform_edt(~goals) * chart.resolution <= NEAR
        length[~(close & open_to)] = np.inf
        self.finished = not np.isfinite(length).any() if goals.any() else True
        self._path = np.zeros((0, 2)) if self.finished else _shortest(chart, length, before)

    def steer(self, here: Pose, age: float = 0.0) -> tuple[float, float]:
        """Return the speed [m/s] and the yaw rate [rad/s] for a robot at a pose, frame map.

        `age` is how old the pose is when the next command comes [s]: meanwhile the robot drives no
        farther than its margin.
        """
        if not len(self._path):
            return 0.0, 0.0
        if self._stuck:
            return (BACK if self._may_back_off(here) else 0.0), 0.0
        away = np.hypot(*(self._path - here[:2]).T)
        nearest = int(np.argmin(away))
        ahead = nearest + int(np.argmax(away[nearest:] >= AHEAD))
        aim = self._path[ahead if away[ahead] >= AHEAD else -1]
        left = math.dist(self._path[-1], here[:2])
        if left < ARRIVED:
            return 0.0, 0.0
        turned = math.remainder(math.atan2(aim[1] - here.y, aim[0] - here.x) - here.yaw, math.tau)
        if abs(turned) > SHARP:
            return 0.0, math.copysign(1.0, turned)
        # Slower in bends and near the end, where there may be little room to stop.
        if not self._has_room(here, MARGIN):
            return 0.0, TURN * turned  # it would cut a corner
        speed = min(self._speed, left, MARGIN / max(age, TINY))
        return speed * (1.0 - abs(turned) / SHARP), TURN * turned

    def _may_back_off(self, here: Pose) -> bool:
        """Return whether a stuck robot has not backed off far yet, and the map has room behind."""
        last = self._last
        is_near = last is not None and math.dist(here[:2], last[:2]) < BACK_FAR
        return is_near and self._has_room(here, -MARGIN)

    def _has_room(self, here: Pose, ahead: float) -> bool:
        """Return whether the robot fits a way ahead of a pose [m], or fits better than there."""
        x = here.x + ahead * math.cos(here.yaw)
        y = here.y + ahead * math.sin(here.yaw)
        there = self._room_at(x, y)
        return there >= self._radius or there > self._room_at(here.x, here.y)

    def _room_at(self, x: float, y: float) -> float:
        """Return how far a point, frame map, is from what is not free on the map [m]."""
        cell = self._chart.cell((x, y)) if self._chart is not None else None
        return float(self._room[cell]) if cell is not None else 0.0

    def _is_stuck(self, here: Pose) -> bool:
        """Return whether the robot had a path since the last plan but did not move."""
        last = self._last
        if last is None or self._stuck or not len(self._path):
            return False
        turned = abs(math.remainder(here.yaw - last.yaw, math.tau))
        return math.dist(here[:2], last[:2]) < STUCK and turned < STUCK

    def _frontiers(self, chart: GridMap) -> NDArray[np.bool_]:
        """Return the free cells beside unknown ones, without small groups and given-up ones."""
        unknown = ndimage.binary_dilation(chart.cells == UNKNOWN)
        frontier = (chart.cells == FREE) & unknown
        groups, _ = ndimage.label(frontier, np.ones((3, 3)))
        sizes = np.bincount(groups.ravel())
        frontier &= sizes[groups] >= MIN_FRONTIER
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


def _paths(
    open_to: NDArray[np.bool_], start: tuple[int, int], weight: Array
) -> tuple[Array, NDArray[np.int32]]:
    """Return the length of the path to every cell [cells], and the cell before it on that path.

    The robot's centre may enter the cells `open_to` it; `weight` stretches the path through each.
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


def _shortest(chart: GridMap, length: Array, before: NDArray[np.int32]) -> Array:
    """Return the path (n, 2) to the cell with the least length, frame map [m]."""
    columns = length.shape[1]
    cell = int(np.argmin(length))
    path = []
    while cell >= 0:
        path.append((cell % columns, cell // columns))
        cell = int(before.flat[cell])
    points: Array = (np.array(path[::-1]) + 0.5) * chart.resolution
    return points + chart.origin[:2]
