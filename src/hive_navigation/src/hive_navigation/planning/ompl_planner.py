# SPDX-License-Identifier: BSD-3-Clause
"""Planning with OMPL, guided by a roadmap. The only module that knows OMPL.

The roadmap (`roadmap.py`) proposes a path; OMPL's `PathSimplifier` shortens it, and OMPL's motion
checks decide whether it is free. If the roadmap misses a path that exists (a gap between obstacles
that only the laser has seen), OMPL's RRTConnect searches without a guide. RRTConnect alone is as
quick but often takes the wrong aisle of a warehouse: see docs/decisions/010-planner.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from ompl import base, geometric, util
from scipy import ndimage

from hive_navigation.planning.clearance import ClearanceField
from hive_navigation.planning.planner import PlanError
from hive_navigation.planning.roadmap import Roadmap

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from hive_common.grid_map import GridMap
    from hive_navigation.planning.clearance import Disc
    from hive_navigation.planning.path import Point

MARGINS = (0.08, 0.02)
"""Clearances beyond the robot's radius [m], tried in this order: a comfortable one, then the least
that works. With a larger one the MiR100 cannot pass a door of 1.2 m."""

GOAL_MARGIN = 0.05
"""Clearance beyond the robot's radius at a goal [m]: it stops a few centimetres off, and turns."""

MAX_ESCAPE = 0.6
"""How far a robot that stands too close to an obstacle may drive to a free place [m]."""

SEARCH_STEPS = 20_000  # RRTConnect gives up after this many steps, about 2 s
SHORTEN_STEPS = 30  # attempts of OMPL's simplifier to cut a corner


class OmplPlanner:
    """A `Planner` for one map and one size of robot."""

    def __init__(self, grid: GridMap, radius: float, *, seed: int = 1) -> None:
        """Prepare for a robot of a radius [m]; takes up to a second for a million cells.

        The same seed, map, start and goal give the same path.
        """
        self.grid = grid
        self.need = radius + MARGINS[-1]  # least clearance to drive and turn [m]
        self.goal_need = radius + GOAL_MARGIN  # least clearance at a goal [m]
        self.field = ClearanceField.of(grid)
        self._roadmaps = [Roadmap(self.field, radius + margin) for margin in MARGINS]
        self._seed = seed
        self._last_discs: tuple[Disc, ...] = ()
        self._last_field = self.field

    def plan(self, start: Point, goal: Point, discs: Sequence[Disc] = ()) -> list[Point]:
        """See `Planner.plan`."""
        self._check_goal(goal)
        field = self._field_with(discs)
        if field.at(*goal) < self.need:
            raise PlanError(
                f"goal ({goal[0]:.2f}, {goal[1]:.2f}): an obstacle that is not on the map is "
                f"within {self.need:.2f} m of it; wait until it is gone, or choose another goal",
                lasting=False,
            )
        begin = self._escape(start, field)
        need, guide = self._guide(begin, goal, field, discs)
        if guide is None:
            self._check_connected(begin, goal, field)
        corners = _Problem(field, need, self._seed).solve(begin, goal, guide)
        return corners if begin == start else [start, *corners]

    def plan_near(self, start: Point, goal: Point, tolerance: float) -> list[Point]:
        """Plan to a goal or, if no path leads there, to the nearest place to it that one leads to.

        Args:
            start: Where to begin, frame map [m].
            goal: Where to end, frame map [m]; it need not be free.
            tolerance: How far from the goal the path may end [m]; 0 or less for at the goal.

        Raises:
            PlanError: There is no path to any place within the tolerance.
        """
        try:
            return self.plan(start, goal)
        except PlanError:
            place = self._reachable_near(start, goal)
            if place is None or not math.dist(place, goal) <= tolerance:
                raise
        return self.plan(start, place)

    def _reachable_near(self, start: Point, goal: Point) -> Point | None:
        """Return the nearest place to a goal at which the robot can stand and be, if any."""
        clearance, resolution = self.field.clearance, self.grid.resolution
        begin = self.grid.cell(self._escape(start, self.field))
        if begin is None:
            return None
        rooms, _ = ndimage.label(clearance >= self.need)
        rows, columns = np.nonzero((rooms == rooms[begin]) & (clearance >= self.goal_need))
        if not len(rows):
            return None
        x = self.grid.origin.x + (columns + 0.5) * resolution
        y = self.grid.origin.y + (rows + 0.5) * resolution
        nearest = np.argmin(np.hypot(x - goal[0], y - goal[1]))
        return float(x[nearest]), float(y[nearest])

    def _field_with(self, discs: Sequence[Disc]) -> ClearanceField:
        """Return the clearances with discs; several plans in a row may share one field."""
        if tuple(discs) != self._last_discs:
            self._last_discs = tuple(discs)
            self._last_field = self.field.with_discs(discs) if discs else self.field
        return self._last_field

    def _guide(
        self, start: Point, goal: Point, field: ClearanceField, discs: Sequence[Disc]
    ) -> tuple[float, list[Point] | None]:
        """Return the roadmap's widest path, or None, and the clearance that it keeps [m]."""
        for roadmap in self._roadmaps:
            guide = roadmap.path(start, goal, field, discs)
            if guide is not None:
                return roadmap.need, guide
        return self.need, None

    def _check_goal(self, goal: Point) -> None:
        """Reject a goal at which the robot can never stand."""
        x, y = goal
        if not (math.isfinite(x) and math.isfinite(y) and self.grid.contains(x, y)):
            x_min, y_min, x_max, y_max = self.grid.bounds
            raise PlanError(
                f"goal ({x:.2f}, {y:.2f}) is not on the map, which extends from "
                f"({x_min:.2f}, {y_min:.2f}) to ({x_max:.2f}, {y_max:.2f}); choose a goal on it",
                lasting=True,
            )
        room = self.field.at(x, y)
        if room < self.goal_need:
            what = "is in a wall or an obstacle" if room == 0 else "is too close to an obstacle"
            raise PlanError(
                f"goal ({x:.2f}, {y:.2f}) {what}: its clearance is {room:.2f} m, this robot needs "
                f"{self.goal_need:.2f} m; choose a goal farther from the obstacles on the map",
                lasting=True,
            )

    def _escape(self, start: Point, field: ClearanceField) -> Point:
        """Return the start, or the nearest place with enough clearance to plan from."""
        if field.at(*start) >= self.need:
            return start
        for distance in np.arange(1, math.ceil(MAX_ESCAPE / 0.05) + 1) * 0.05:
            for angle in np.arange(0.0, 2 * math.pi, math.pi / 12):
                place = (
                    float(start[0] + distance * math.cos(angle)),
                    float(start[1] + distance * math.sin(angle)),
                )
                if field.at(*place) >= self.need:
                    return place
        lasting = self.field.at(*start) < self.need
        raise PlanError(
            f"the robot is at ({start[0]:.2f}, {start[1]:.2f}) with no free place within "
            f"{MAX_ESCAPE:.1f} m (clearance {field.at(*start):.2f} m, needed {self.need:.2f} m); "
            "clear the space around it, or correct its pose on the map",
            lasting=lasting,
        )

    def _check_connected(self, start: Point, goal: Point, field: ClearanceField) -> None:
        """Raise if no path can connect start and goal."""
        if field.connects(start, goal, self.need):
            return
        lasting = not self.field.connects(start, goal, self.need)
        where = "on this map" if lasting else "around the obstacles that are not on the map"
        remedy = "choose another goal" if lasting else "clear the path, or choose another goal"
        raise PlanError(
            f"no path {2 * self.need:.2f} m wide from ({start[0]:.2f}, {start[1]:.2f}) to "
            f"({goal[0]:.2f}, {goal[1]:.2f}) {where}; {remedy}",
            lasting=lasting,
        )


class _Problem:
    """One planning problem in OMPL's terms; it keeps OMPL's objects alive."""

    def __init__(self, field: ClearanceField, need: float, seed: int) -> None:
        util.setLogLevel(util.LogLevel.LOG_NONE)
        # OMPL reports an error if generators exist already, but new ones do follow the seed.
        util.RNG.setSeed(seed)
        x_min, y_min, x_max, y_max = field.grid.bounds
        bounds = base.RealVectorBounds(2)
        for axis, (low, high) in enumerate(((x_min, x_max), (y_min, y_max))):
            bounds.setLow(axis, low)
            bounds.setHigh(axis, high)
        self._space = base.RealVectorStateSpace(2)
        self._space.setBounds(bounds)
        self._information = base.SpaceInformation(self._space)
        # OMPL rejects numpy's bool; comparing two Python floats gives Python's.
        self._information.setStateValidityChecker(
            lambda state: field.at(state[0], state[1]) >= need
        )
        self._information.setMotionValidator(_Motions(self._information, field, need))
        self._information.setup()

    def solve(self, start: Point, goal: Point, guide: list[Point] | None) -> list[Point]:
        """Return a short free path, from a `guide` if given; raise PlanError if none is found."""
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
        """Search without a guide."""
        problem = base.ProblemDefinition(self._information)
        problem.setStartAndGoalStates(self._state(start), self._state(goal))
        planner = geometric.RRTConnect(self._information)
        planner.setProblemDefinition(problem)
        planner.setup()
        # Steps, not seconds: a slow machine must find the same path.
        steps = iter(range(SEARCH_STEPS))
        planner.solve(base.PlannerTerminationCondition(lambda: next(steps, None) is None))
        if not problem.hasExactSolution():
            raise PlanError(
                f"found no path from ({start[0]:.2f}, {start[1]:.2f}) to "
                f"({goal[0]:.2f}, {goal[1]:.2f}) in {SEARCH_STEPS} steps; "
                "widen the narrowest gap on the path, or choose another goal",
                lasting=False,
            )
        return problem.getSolutionPath()


class _Motions(base.MotionValidator):  # type: ignore[misc]  # OMPL ships no types
    """Checks a straight motion in strides as long as the clearance allows."""

    def __init__(self, information: Any, field: ClearanceField, need: float) -> None:  # noqa: ANN401  (OMPL ships no types)
        super().__init__(information)
        self._field = field
        self._need = need

    def checkMotion(self, a: Any, b: Any) -> bool:  # noqa: ANN401, N802  (OMPL's name and types)
        """Return whether the robot can go straight from a to b."""
        return self._field.line_is_clear((a[0], a[1]), (b[0], b[1]), self._need)
