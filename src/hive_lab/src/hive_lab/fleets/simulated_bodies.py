# SPDX-License-Identifier: BSD-3-Clause
"""Robots of a virtual fleet that drive in the simulator, by their own navigation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.domain.task import StepKind
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.fleets.coordination import by_a_plan
from hive_lab.fleets.sites import Site
from hive_lab.fleets.traffic import STEP, Traffic
from robot_description.models import load_model
from simenv.bodies.pick import Act, Order
from simenv.bodies.pick import PickOutcome as Grip
from simenv.simulation import Simulation
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blackboard.domain.task import TaskStep
    from blackboard.robot.executor import Command
    from fleet_manager.config.fleet_file import FleetRobot
    from hive_common.zone import Zone
    from hive_lab.fleets.true_battery import TrueBattery
    from hive_lab.fleets.virtual_fleet import VirtualFleet
    from hive_navigation.traffic.coordinator import Coordinator

TOLD = 4  # a robot learns its pose and distance driven every so many steps: at 10 Hz
_ACTS = {StepKind.PICK: Act.PICK, StepKind.PLACE: Act.PLACE}


class SimulatedBodies:
    """Bodies in a simulation; see `virtual_fleet.Bodies`.

    Args:
        world: Name or path of the world.
        seed: Of the simulation's noise.
        chart: Name or path of the robots' map; empty for that of the world.
        models: With a traffic planner: the models of the robots, which it plans for.
        zones: What the traffic planner knows of areas.
    """

    def __init__(
        self,
        world: str,
        seed: int,
        chart: str = "",
        models: Sequence[str] = (),
        zones: Sequence[Zone] = (),
    ) -> None:
        content, grid = load_world(world), load_map(chart or world)
        self.simulation = Simulation(content, seed=seed)
        if models:
            site = Site(content, grid, room=0.0)
            self._traffic = by_a_plan(models, zones, self.simulation, site)
        else:
            self._traffic = Traffic(self.simulation, grid)
        self._bodies: list[SimulatedBody] = []
        self._steps = 0

    @property
    def coordinator(self) -> Coordinator | None:
        """The traffic planner, if there is one."""
        return self._traffic.coordinator

    def command(self, robot: FleetRobot, fleet: VirtualFleet) -> Mapping[StepKind, Command]:
        """Spawn a robot; return its command for each kind of step."""

        def tell(pose: Pose, distance: float) -> None:
            fleet.robots[robot.name].add_travel(distance)
            fleet.robots[robot.name].set_pose(pose)

        body = self.add(robot, fleet.network.schedule)
        body.battery = fleet.true_batteries.get(robot.name)
        body.load = lambda: fleet.robots[robot.name].status.payload
        body.tell = tell
        return dict.fromkeys(StepKind, body)

    def add(
        self, robot: FleetRobot, schedule: Callable[[float, Callable[[], None]], object]
    ) -> SimulatedBody:
        """Spawn a robot.

        Args:
            robot: Its name, model and pose.
            schedule: Has a function called after a time [s]; time passes for all bodies by it.
        """
        self._traffic.add(robot.name, load_model(robot.model), robot.pose)
        body = SimulatedBody(robot.name, self.simulation, self._traffic)
        if not self._bodies:
            schedule(STEP, lambda: self._step(schedule))
        self._bodies.append(body)
        return body

    def _step(self, schedule: Callable[[float, Callable[[], None]], object]) -> None:
        schedule(STEP, lambda: self._step(schedule))
        self._traffic.step()
        self._steps += 1
        for body in self._bodies:
            if self._steps % TOLD == 0:
                body.look_where_it_is()
            body.look()


class SimulatedBody:
    """One robot's wheels and arm; see `blackboard.robot.executor.Command`.

    Attributes:
        battery: What it draws from, where that is not reckoned by the robot.
        load: Returns what is on board [kg].
        tell: Called ten times a second with its pose [map frame] and the distance driven since
            the last time [m].
    """

    def __init__(self, name: str, simulation: Simulation, traffic: Traffic) -> None:
        self.battery: TrueBattery | None = None
        self.load: Callable[[], float] = float
        self.tell: Callable[[Pose, float], None] = lambda _pose, _distance: None
        self._name = name
        self._simulation = simulation
        self._traffic = traffic
        self._was = simulation.odometry(name)
        self._done: Callable[[CommandResult], None] | None = None
        self._kind = StepKind.MOVE

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self._done, self._kind = done, step.kind
        navigator = self._traffic.navigators[self._name]
        navigator.stationary = step.kind is not StepKind.MOVE
        if step.kind is StepKind.MOVE:
            self._traffic.send(self._name, (step.goal.x, step.goal.y, step.goal.yaw))
            return
        order = Order(_ACTS[step.kind], step.task_id, step.payload)
        self._simulation.arm(self._name).start(order, self._simulation.poses[self._name])

    def cancel(self) -> None:
        """Stop."""
        self._done = None
        self._traffic.navigators[self._name].cancel()
        self._simulation.arm(self._name).cancel()

    def look(self) -> None:
        """Check whether the step has ended."""
        done = self._done
        if done is None:
            return
        if self._kind is StepKind.MOVE:
            outcome = self._traffic.outcomes.get(self._name)
            if outcome is None:
                return
            works, text = outcome.reached, outcome.text
        else:
            result = self._simulation.arm(self._name).result
            if result is None:
                return
            works, text = result.outcome is Grip.SUCCESS, result.message
            self._traffic.navigators[self._name].stationary = False
            if works and self.battery is not None:
                self.battery.grip(self._kind)
        self._done = None
        done(CommandResult(CommandState.SUCCEEDED if works else CommandState.ABORTED, text))

    def look_where_it_is(self) -> None:
        """Draw what the time since the last look took, and tell the pose and the distance."""
        now = self._simulation.odometry(self._name)
        distance = math.dist(now[:2], self._was[:2])
        self._was = now
        if self.battery is not None:
            self.battery.run(TOLD * STEP, distance, self.load())
        self.tell(Pose(*self._simulation.poses[self._name]), distance)
