# SPDX-License-Identifier: BSD-3-Clause
"""Drives several navigators in a simulated world without ROS, for tests of their traffic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from hive_common.pose import Pose
from robot_navigation.control.navigator import Navigator
from robot_navigation.control.pursuit_follower import PursuitFollower
from robot_navigation.planning.ompl_planner import OmplPlanner

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_common.map_file import GridMap
    from robot_description.models import RobotModel
    from robot_navigation.control.goal_tracker import Outcome
    from robot_navigation.traffic.right_of_way import Announcement

STEP = 0.025
"""One step of the simulation [s]."""

STEPS_PER_ROUND = 4
"""A control loop goes round at 10 Hz."""

STEPS_TO_HEAR = 6
"""An announcement is heard 0.15 s after it was made."""


class World(Protocol):
    """What is used of `simenv.simulation.Simulation`."""

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        ...

    @property
    def poses(self) -> Mapping[str, Any]:
        """Where all robots are, frame map."""
        ...

    def add_robot(self, name: str, model: RobotModel, pose: tuple[float, float, float]) -> None:
        """Put a robot into the world."""
        ...

    def scan(self, name: str) -> Any:  # noqa: ANN401  (an array of distances)
        """Return what its laser measures [m]."""
        ...

    def set_command(self, name: str, vx: float, vy: float, wz: float) -> None:
        """Command its base."""
        ...

    def step(self, dt: float) -> None:
        """Let time pass."""
        ...


class Traffic:
    """Robots that navigate in one world and hear each other with some delay.

    Attributes:
        navigators: By robot.
        outcomes: How the latest goal of each robot has ended.
        mute: Robots that do not speak to the others.
        deaf: Robots that hear nobody.
        held_up: Robots whose process gets no processor: their control loop stands still.
    """

    def __init__(self, world: World, grid: GridMap) -> None:
        self.navigators: dict[str, Navigator] = {}
        self.outcomes: dict[str, Outcome] = {}
        self.mute: set[str] = set()
        self.deaf: set[str] = set()
        self.held_up: set[str] = set()
        self._world = world
        self._grid = grid
        self._planners: dict[str, OmplPlanner] = {}
        self._heard: dict[str, Announcement] = {}
        self._said: list[tuple[int, Announcement]] = []
        self._steps = 0

    def add(self, name: str, model: RobotModel, pose: tuple[float, float, float]) -> None:
        """Put a robot with a navigator into the world; models of one name share a planner."""
        self._world.add_robot(name, model, pose)
        radius = model.base.circumscribed_radius
        planner = self._planners.setdefault(model.name, OmplPlanner(self._grid, radius))
        follower = PursuitFollower(model.base)
        self.navigators[name] = Navigator(name, model, planner, follower, planner.field)

    def send(self, name: str, goal: tuple[float, float, float]) -> None:
        """Give a robot a goal, frame map."""
        self.outcomes.pop(name, None)
        self.navigators[name].set_goal(Pose(*goal), self._world.time)

    def step(self) -> None:
        """Let one step of time pass."""
        for number, (name, navigator) in enumerate(self.navigators.items()):
            if (self._steps - number) % STEPS_PER_ROUND == 0 and name not in self.held_up:
                self._round(name, navigator)
        while self._said and self._said[0][0] <= self._steps:
            said = self._said.pop(0)[1]
            self._heard[said.name] = said
        self._world.step(STEP)
        self._steps += 1

    def run(self, seconds: float) -> bool:
        """Go on until nobody has a goal any more; return False if that takes too long."""
        end = self._world.time + seconds
        while any(navigator.goal is not None for navigator in self.navigators.values()):
            if self._world.time > end:
                return False
            self.step()
        return True

    def _round(self, name: str, navigator: Navigator) -> None:
        pose = Pose(*self._world.poses[name])
        heard = () if name in self.deaf else tuple(self._heard.values())
        tick = navigator.tick(self._world.time, pose, self._world.scan(name), heard)
        self._world.set_command(name, *tick.velocity)
        if name not in self.mute:
            self._said.append((self._steps + STEPS_TO_HEAR, tick.announcement))
        if tick.outcome is not None:
            self.outcomes[name] = tick.outcome
