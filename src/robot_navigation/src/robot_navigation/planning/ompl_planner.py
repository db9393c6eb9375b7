# SPDX-License-Identifier: BSD-3-Clause
"""Planning with OMPL, guided by a roadmap. The only module that knows OMPL.

The roadmap (`roadmap.py`) says which way round; OMPL's `PathSimplifier` shortens that way, and its
motion checks have the last word on whether it is free. Where the landmarks hold no way although
there is one (gaps between things that only the laser has seen), OMPL's RRTConnect searches by
itself. Left alone, RRTConnect is as quick but often takes the wrong aisle of a warehouse: the
figures are in docs/decisions/010-planner.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from ompl import base, geometric, util
from scipy import ndimage

from hive_common.grid_map import ClearanceField
from robot_navigation.planning.planner import PlanError
from robot_navigation.planning.roadmap import Roadmap

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from hive_common.grid_map import Disc
    from hive_common.map_file import GridMap

Point = tuple[float, float]

MARGINS = (0.08, 0.02)
"""Room beside the robot when it turns on the spot [m]: first what is comfortable, and where there
is no such way what just does; with more the MiR100 could not pass a door of 1.2 m."""

STANDING = 0.05
"""Room beside the robot at a goal [m]: it does not stop to the centimetre, and then turns."""

BESIDE = 0.6
"""How far a robot that stands too close to something may go to the next free place [m]."""

SEARCH_STEPS = 20_000
"""After this many steps RRTConnect gives up; about 2 s."""

SHORTEN_STEPS = 30
"""Attempts of OMPL's simplifier to cut a corner."""


class OmplPlanner:
    """A `Planner` for one map and one size of robot.

    Attributes:
        grid: The map.
        need: Least clearance that the robot needs to drive and turn [m].
        goal_need: Least clearance that it needs at a goal [m].
        field: The clearances of the map.
    """

    def __init__(self, grid: GridMap, radius: float, *, seed: int = 1) -> None:
        """Prepare for many plans on one map; takes up to a second for a million cells.

        Args:
            grid: The map.
            radius: Radius of the circle that holds the footprint [m].
            seed: The same seed, map, start and goal give the same plan.
        """
        self.grid = grid
        self.need = radius + MARGINS[-1]
        self.goal_need = radius + STANDING
        self.field = ClearanceField.of(grid)
        self._roadmaps = [Roadmap(self.field, radius + margin) for margin in MARGINS]
        self._seed = seed

    def plan(self, start: Point, goal: Point, discs: Sequence[Disc] = ()) -> list[Point]:
        """See `Planner.plan`."""
        self._check_goal(goal)
        field = self.field.with_discs(discs) if discs else self.field
        if field.at(*goal) < self.need:
            raise PlanError(
                f"goal ({goal[0]:.2f}, {goal[1]:.2f}): something that is not on the map stands "
                f"within {self.need:.2f} m of it; wait until it is gone, or choose another goal",
                lasting=False,
            )
        begin = self._free_place_beside(start, field)
        need, guide = self._guide(begin, goal, field, discs)
        if guide is None:
            self._check_connected(begin, goal, field)
        corners = _Problem(field, need, self._seed).solve(begin, goal, guide)
        return corners if begin == start else [start, *corners]

    def _guide(
        self, start: Point, goal: Point, field: ClearanceField, discs: Sequence[Disc]
    ) -> tuple[float, list[Point] | None]:
        """Return a way of the roadmap with as much room as there is, and that room [m]."""
        for roadmap in self._roadmaps:
            if discs:
                guide = roadmap.way_around(start, goal, field, discs)
            else:
                guide = roadmap.way(start, goal, field)
            if guide is not None:
                return roadmap.need, guide
        return self.need, None

    def _check_goal(self, goal: Point) -> None:
        """Refuse a goal at which the robot can never stand."""
        x, y = goal
        if not (math.isfinite(x) and math.isfinite(y) and self.grid.contains(x, y)):
            x_min, y_min, x_max, y_max = self.grid.bounds
            raise PlanError(
                f"goal ({x:.2f}, {y:.2f}) is not on the map, which reaches from "
                f"({x_min:.2f}, {y_min:.2f}) to ({x_max:.2f}, {y_max:.2f}); choose a goal on it",
                lasting=True,
            )
        room = self.field.at(x, y)
        if room < self.goal_need:
            what = "is in a wall or an obstacle" if room == 0 else "is too close to an obstacle"
            raise PlanError(
                f"goal ({x:.2f}, {y:.2f}) {what}: the clearance is {room:.2f} m, this robot needs "
                f"{self.goal_need:.2f} m; choose a goal farther from the obstacles of the map",
                lasting=True,
            )

    def _free_place_beside(self, start: Point, field: ClearanceField) -> Point:
        """Return the start, or the nearest place from which the robot can plan."""
        if field.at(*start) >= self.need:
            return start
        for distance in np.arange(1, math.ceil(BESIDE / 0.05) + 1) * 0.05:
            for angle in np.arange(0.0, 2 * math.pi, math.pi / 12):
                place = (
                    float(start[0] + distance * math.cos(angle)),
                    float(start[1] + distance * math.sin(angle)),
                )
                if field.at(*place) >= self.need:
                    return place
        lasting = self.field.at(*start) < self.need
        raise PlanError(
            f"the robot stands at ({start[0]:.2f}, {start[1]:.2f}) and has no free place within "
            f"{BESIDE:.1f} m (clearance {field.at(*start):.2f} m, needed {self.need:.2f} m); "
            "clear the space around it, or correct its pose on the map",
            lasting=lasting,
        )

    def _check_connected(self, start: Point, goal: Point, field: ClearanceField) -> None:
        """Raise if start and goal lie in parts of the map with no way between them."""
        if _connected(field, self.need, start, goal):
            return
        lasting = not _connected(self.field, self.need, start, goal)
        why = "on this map" if lasting else "past what stands in the way"
        remedy = "choose another goal" if lasting else "clear the way, or choose another goal"
        raise PlanError(
            f"no way from ({start[0]:.2f}, {start[1]:.2f}) to ({goal[0]:.2f}, {goal[1]:.2f}) "
            f"{why} that is {2 * self.need:.2f} m wide; {remedy}",
            lasting=lasting,
        )


def _connected(field: ClearanceField, need: float, start: Point, goal: Point) -> bool:
    """Return whether a robot could get from start to goal at all."""
    parts, _ = ndimage.label(field.clearance >= need)
    grid = field.grid
    cells = np.floor((np.array([start, goal]) - np.array(grid.origin[:2])) / grid.resolution)
    (column, row), (goal_column, goal_row) = cells.astype(int)
    return bool(parts[row, column] == parts[goal_row, goal_column] != 0)


class _Problem:
    """One planning problem in OMPL's terms; OMPL's objects live as long as this one."""

    def __init__(self, field: ClearanceField, need: float, seed: int) -> None:
        util.setLogLevel(util.LogLevel.LOG_NONE)
        # OMPL calls it an error to seed once generators exist, but new ones do follow the seed.
        util.RNG.setSeed(seed)
        x_min, y_min, x_max, y_max = field.grid.bounds
        bounds = base.RealVectorBounds(2)
        for axis, (low, high) in enumerate(((x_min, x_max), (y_min, y_max))):
            bounds.setLow(axis, low)
            bounds.setHigh(axis, high)
        self._space = base.RealVectorStateSpace(2)
        self._space.setBounds(bounds)
        self._information = base.SpaceInformation(self._space)
        # OMPL accepts no numpy bool here; comparing two floats of Python gives a Python one.
        self._information.setStateValidityChecker(
            lambda state: field.at(state[0], state[1]) >= need
        )
        self._information.setMotionValidator(_Motions(self._information, field, need))
        self._information.setup()

    def solve(self, start: Point, goal: Point, guide: list[Point] | None) -> list[Point]:
        """Return a short free way.

        Args:
            start: Frame map [m].
            goal: Frame map [m].
            guide: A way to improve; None to search for one.

        Raises:
            PlanError: None was found.
        """
        path = None if guide is None else self._path(guide)
        if path is None or not path.check():
            path = self._search(start, goal)
        simplifier = geometric.PathSimplifier(self._information)
        simplifier.reduceVertices(path)
        simplifier.partialShortcutPath(path, SHORTEN_STEPS, SHORTEN_STEPS)
        points = [(state[0], state[1]) for state in path.getStates()]
        return [start, *points[1:-1], goal]

    def _path(self, points: list[Point]) -> Any:  # noqa: ANN401  (OMPL ships no types)
        return geometric.PathGeometric(self._information, [self._state(point) for point in points])

    def _state(self, point: Point) -> Any:  # noqa: ANN401  (OMPL ships no types)
        state = self._space.allocState()
        state[0], state[1] = point
        return state

    def _search(self, start: Point, goal: Point) -> Any:  # noqa: ANN401  (OMPL ships no types)
        """Search with RRTConnect."""
        problem = base.ProblemDefinition(self._information)
        problem.setStartAndGoalStates(self._state(start), self._state(goal))
        planner = geometric.RRTConnect(self._information)
        planner.setProblemDefinition(problem)
        planner.setup()
        # Counting steps instead of seconds keeps plans the same on a slow machine.
        steps = iter(range(SEARCH_STEPS))
        planner.solve(base.PlannerTerminationCondition(lambda: next(steps, None) is None))
        if not problem.hasExactSolution():
            raise PlanError(
                f"no way found from ({start[0]:.2f}, {start[1]:.2f}) to "
                f"({goal[0]:.2f}, {goal[1]:.2f}) in {SEARCH_STEPS} steps; "
                "widen the narrowest gap on the way, or choose another goal",
                lasting=False,
            )
        return problem.getSolutionPath()


class _Motions(base.MotionValidator):  # type: ignore[misc]  # OMPL ships no types
    """Checks straight motions in strides as long as the clearance allows."""

    def __init__(self, information: Any, field: ClearanceField, need: float) -> None:  # noqa: ANN401  (OMPL ships no types)
        super().__init__(information)
        self._field = field
        self._need = need

    def checkMotion(self, a: Any, b: Any) -> bool:  # noqa: ANN401, N802  (OMPL's name and types)
        """Return whether the robot can go straight from a to b."""
        return self._field.line_is_clear((a[0], a[1]), (b[0], b[1]), self._need)
