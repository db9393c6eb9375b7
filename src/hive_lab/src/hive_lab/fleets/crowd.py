# SPDX-License-Identifier: BSD-3-Clause
"""Many robots that drive in one place, for tests and benchmarks of navigation and traffic.

Every robot gets a random goal and the next one as soon as it has ended. All have lasers, and
everything runs in this process: the simulator, the planner, the follower and the right of way.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_lab.fleets.delays import Delays
from hive_lab.fleets.sites import hall
from hive_lab.fleets.traffic import STEP, STEPS_PER_ROUND, Traffic
from hive_navigation.control.goal_tracker import StuckDetector
from hive_navigation.planning.clearance import ClearanceField
from robot_description.models import load_model
from simenv.errors import SpawnError
from simenv.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_lab.fleets.sites import Box, Site

MODELS = ("mir100", "ld60", "youbot", "fetch")
APART = 1.6  # distance of two starts [m]
GOALS_APART = 1.2  # distance of the goals of two robots [m]

PoseTuple = tuple[float, float, float]


def robot_name(number: int) -> str:
    """Return the name of a robot of a crowd; the first one has number 0."""
    return f"robot{number + 1}"


def by_right_of_way(simulation: Simulation, site: Site) -> Traffic:
    """Return navigation without a traffic planner."""
    return Traffic(simulation, site.grid)


class Drive(NamedTuple):
    """A goal that has ended.

    Attributes:
        robot: Who drove.
        origin: Where it was when it got the goal, x and y, frame map [m].
        goal: Where it should go, frame map [m, m, rad].
        began, ended: When [s].
        outcome: Empty if it got there, else why not.
    """

    robot: str
    origin: tuple[float, float]
    goal: PoseTuple
    began: float
    ended: float
    outcome: str


class Crowd:
    """Robots in one place, each with a goal that no other one has.

    Attributes:
        simulation: The world and the robots' bodies.
        traffic: The robots' navigation.
        drives: Every goal that has ended.
        longest_stand: The longest time for which a robot with a goal stood still [s], by robot.
    """

    def __init__(
        self,
        robots: int,
        seed: int = 1,
        site: Site | None = None,
        models: Sequence[str] = MODELS,
        traffic_of: Callable[[Simulation, Site], Traffic] = by_right_of_way,
        avoided: Box | None = None,
        *,
        delayed: bool = False,
    ) -> None:
        """Put robots down at random.

        Args:
            robots: How many.
            seed: Of everything random. A robot draws its goals for itself, so that a larger crowd
                adds robots and leaves the first ones theirs.
            site: Where they drive; a hall by default.
            models: The robots' models, in turn.
            traffic_of: Makes the robots' navigation, and what coordinates it.
            avoided: Where no robot starts or has a goal.
            delayed: Whether robots stop at random; see `Delays`.
        """
        site = site or hall()
        self.simulation = Simulation(site.world, seed=seed)
        self.traffic = traffic_of(self.simulation, site)
        self.drives: list[Drive] = []
        self.longest_stand: dict[str, float] = {}
        self._places = _outside(_free_places(site.grid, site.room), avoided)
        self._random: dict[str, np.random.Generator] = {}
        self._goals: dict[str, PoseTuple] = {}
        self._under_way: dict[str, tuple[tuple[float, float], float]] = {}
        self._stuck: dict[str, StuckDetector] = {}
        for number in range(robots):
            self._put(robot_name(number), models[number % len(models)], (seed, number))
        self._delays = Delays(seed) if delayed else None
        self._steps = 0

    def run(self, seconds: float) -> None:
        """Let a simulated time [s] pass."""
        for _ in range(round(seconds / STEP)):
            self.step()

    def step(self) -> None:
        """Advance by one step, after a new goal for everybody who has none."""
        for name, navigator in self.traffic.navigators.items():
            if navigator.goal is None:
                self._give_goal(name)
        if self._delays is not None:
            names, now = self.simulation.names, self.simulation.time
            self.traffic.stopped = self._delays.stopped(names, now)
        self.traffic.step()
        if self._steps % STEPS_PER_ROUND == 0:
            self._watch()
        self._steps += 1

    def _put(self, name: str, model: str, seed: tuple[int, int]) -> None:
        """Put a robot where nobody is near."""
        self._random[name] = np.random.default_rng(seed)
        self._stuck[name] = StuckDetector()
        self.longest_stand[name] = 0.0
        while True:
            pose = self._pose(name)
            if _least_distance(pose, list(self.simulation.poses.values())) < APART:
                continue
            try:
                self.traffic.add(name, load_model(model), pose)
            except SpawnError:
                continue
            return

    def _give_goal(self, name: str) -> None:
        """Note how the robot's last goal ended, and give it the next."""
        now, here = self.simulation.time, self.simulation.poses[name]
        if name in self._under_way:
            origin, began = self._under_way[name]
            outcome = self.traffic.outcomes[name]
            text = "" if outcome.reached else outcome.text
            self.drives.append(Drive(name, origin, self._goals[name], began, now, text))
        others = [goal for robot, goal in self._goals.items() if robot != name]
        goal = self._pose(name)
        while _least_distance(goal, others) < GOALS_APART:
            goal = self._pose(name)
        self._goals[name] = goal
        self._under_way[name] = (here.x, here.y), now
        self._stuck[name] = StuckDetector()
        self.traffic.send(name, goal)

    def _watch(self) -> None:
        """Take note of who stands still."""
        now = self.simulation.time
        for name, pose in self.simulation.poses.items():
            stuck = self._stuck[name]
            stuck.update(now, pose)
            self.longest_stand[name] = max(self.longest_stand[name], stuck.duration(now))

    def _pose(self, name: str) -> PoseTuple:
        """Return a random pose at which every model can stand."""
        random = self._random[name]
        x, y = random.choice(self._places)
        return float(x), float(y), float(random.uniform(-math.pi, math.pi))


def _least_distance(pose: PoseTuple, others: Sequence[tuple[float, float, float]]) -> float:
    return min((math.dist(pose[:2], other[:2]) for other in others), default=math.inf)


def _free_places(grid: GridMap, room: float) -> Array:
    """Return places with a clearance of `room` [m], (n, 2), frame map [m]."""
    rows, columns = np.nonzero(ClearanceField.of(grid).clearance >= room)
    places: Array = (np.column_stack([columns, rows]) + 0.5) * grid.resolution
    places += np.array(grid.origin[:2])
    return places


def _outside(places: Array, box: Box | None) -> Array:
    """Return the places that are not in a box, nor so near that a robot reaches into it."""
    if box is None:
        return places
    x, y = places.T
    left, low, right, high = box
    near = (x > left - APART) & (x < right + APART) & (y > low - APART) & (y < high + APART)
    found: Array = places[~near]
    return found
