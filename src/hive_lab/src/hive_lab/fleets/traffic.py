# SPDX-License-Identifier: BSD-3-Clause
"""Several navigators in one simulated world, without ROS: for tests and benchmarks of traffic."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from hive_common.pose import Pose
from hive_navigation.control.navigator import Navigator
from hive_navigation.control.pursuit_follower import PursuitFollower
from hive_navigation.planning.ompl_planner import OmplPlanner
from hive_navigation.traffic.neighbourhood import Neighbourhood
from robot_description.scan import Scan

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_navigation.control.goal_tracker import GoalOutcome
    from hive_navigation.mapf.route import Route
    from hive_navigation.traffic.coordinator import Coordinator
    from hive_navigation.traffic.right_of_way import Announcement
    from robot_description.models import Laser, RobotModel
    from simenv.simulation import Simulation

STEP = 0.025  # one step of the simulation [s]
STEPS_PER_ROUND = 4  # the control loops run at 10 Hz
STEPS_TO_HEAR = 6  # robots hear an announcement, or a plan, 0.15 s after it was made


class Traffic:
    """Robots that navigate in one world and hear each other with a delay.

    Attributes:
        navigators: By robot.
        outcomes: How the latest goal of each robot ended.
        deaf: Robots that hear nobody.
        held_up: Robots whose process gets no processor: their control loop does not run.
        stopped: Robots whose wheels do not turn, whatever their control loop wants.
        coordinator: Plans for all robots; None lets them go by the right of way alone.
        plan_times: Processor time of each of its plans [s].
    """

    def __init__(
        self, simulation: Simulation, grid: GridMap, coordinator: Coordinator | None = None
    ) -> None:
        self.navigators: dict[str, Navigator] = {}
        self.outcomes: dict[str, GoalOutcome] = {}
        self.deaf: set[str] = set()
        self.held_up: set[str] = set()
        self.stopped: set[str] = set()
        self.coordinator = coordinator
        self.plan_times: list[float] = []
        self._simulation = simulation
        self._grid = grid
        self._lasers: dict[str, Laser] = {}
        self._planners: dict[str, OmplPlanner] = {}
        self._heard = Neighbourhood()
        self._said: list[tuple[int, Announcement]] = []
        self._plans: list[tuple[int, tuple[Route, ...]]] = []
        self._steps = 0

    def add(self, name: str, model: RobotModel, pose: tuple[float, float, float]) -> None:
        """Add a robot with a navigator; robots of one model share a planner."""
        self._simulation.add_robot(name, model, pose)
        if model.name not in self._planners:
            self._planners[model.name] = OmplPlanner(self._grid, model.base.circumscribed_radius)
        planner = self._planners[model.name]
        self._lasers[name] = model.laser
        follower = PursuitFollower(model.base)
        self.navigators[name] = Navigator(name, model, planner, follower, planner.field)

    def send(self, name: str, goal: tuple[float, float, float]) -> None:
        """Give a robot a goal, frame map."""
        self.outcomes.pop(name, None)
        self.navigators[name].set_goal(Pose(*goal), self._simulation.time)

    def announce(self, said: Announcement) -> None:
        """Have all hear what a robot announces that is not one of the navigators."""
        self._said.append((self._steps + STEPS_TO_HEAR, said))

    def step(self) -> None:
        """Advance by one step."""
        due = [name for name in self._due() if name not in self.held_up]
        poses, scans = self._simulation.poses, self._simulation.scans(due) if due else []
        for name, ranges in zip(due, scans, strict=True):
            self._round(name, poses[name], ranges)
        while self._said and self._said[0][0] <= self._steps:
            said = self._said.pop(0)[1]
            self._heard.hear(said)
            if self.coordinator is not None:
                self.coordinator.hear(said)
        if self.coordinator is not None and self._steps % STEPS_PER_ROUND == 0:
            self._coordinate(self.coordinator)
        self._simulation.step(STEP)
        self._steps += 1

    def _coordinate(self, coordinator: Coordinator) -> None:
        """Let the coordinator plan, and the robots hear its plans."""
        began = time.process_time()
        routes = coordinator.step(self._simulation.time)
        if routes:
            self.plan_times.append(time.process_time() - began)
            self._plans.append((self._steps + STEPS_TO_HEAR, routes))
        while self._plans and self._plans[0][0] <= self._steps:
            plan = self._plans.pop(0)[1]
            for name, navigator in self.navigators.items():
                if name not in self.deaf:
                    navigator.take_routes(plan, self._simulation.time)

    def run(self, seconds: float) -> bool:
        """Advance until no robot has a goal; return False if that takes longer than `seconds`."""
        end = self._simulation.time + seconds
        while any(navigator.goal is not None for navigator in self.navigators.values()):
            if self._simulation.time > end:
                return False
            self.step()
        return True

    def _due(self) -> list[str]:
        """Return the robots whose round it is; the rounds of others come in other steps."""
        return list(self.navigators)[self._steps % STEPS_PER_ROUND :: STEPS_PER_ROUND]

    def scan_of(self, name: str, ranges: Array) -> Scan:
        """Return what the laser of a robot measured, (n,) [m] as the simulation has it."""
        return Scan.of(self._lasers[name], ranges)

    def _round(self, name: str, pose: Pose, ranges: Array) -> None:
        heard = Neighbourhood() if name in self.deaf else self._heard
        tick = self.navigators[name].tick(
            self._simulation.time, pose, self.scan_of(name, ranges), heard
        )
        wanted = (0.0, 0.0, 0.0) if name in self.stopped else tick.velocity
        self._simulation.set_command(name, *wanted)
        self.announce(tick.announcement)
        if tick.outcome is not None:
            self.outcomes[name] = tick.outcome
