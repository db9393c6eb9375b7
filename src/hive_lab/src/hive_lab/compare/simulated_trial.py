# SPDX-License-Identifier: BSD-3-Clause
"""A trial with the robots of a fleet file, which drive in the simulator."""

from __future__ import annotations

from functools import cache, partial
from random import Random
from typing import TYPE_CHECKING

import yaml

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.task import StepKind
from blackboard.robot.charging import NEAR, ChargingPlan
from blackboard.robot.executor import CommandState
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.architectures.trial import Choices, Trial, TrialRobot
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, Quality
from hive_lab.fleets.simulated_bodies import TOLD, SimulatedBodies
from hive_lab.fleets.traffic import STEP
from hive_lab.fleets.true_battery import TrueBattery
from hive_lab.virtual.network import LATENCY
from robot_description.models import model_path
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.task import TaskStep
    from blackboard.robot.executor import CommandResult
    from fleet_manager.config.fleet_file import Fleet, FleetRobot
    from fleet_manager.config.scenario import Scenario
    from hive_lab.architectures.ledger import Ledger
    from hive_lab.fault_schedules.faulty_network import Host
    from hive_lab.fleets.simulated_bodies import SimulatedBody

_STILL = 0.001  # a robot that drives less than this between two looks stands [m]
_THERE = 0.1  # one that drives less than this in a step was there before [m]


class SimulatedTrial(Trial):
    """A fleet that works through a scenario.

    Args:
        fleet: The robots, and how they decide.
        scenario: What is posted.
        seed: Of the simulation's noise and of the network.
        loss: Share of the messages between two nodes that are lost.

    Attributes:
        simulation: In which the robots drive.
    """

    def __init__(self, fleet: Fleet, scenario: Scenario, seed: int, loss: float) -> None:
        random = Random(seed)
        network = FaultyNetwork(random, proofs=1.0)
        # All messages take the same time: on ROS, those of one topic do not overtake each other.
        network.quality = Quality(loss=loss, delay=LATENCY)
        for robot in fleet.robots:
            network.add_host(robot.name)
        self._chargers = {
            place.name: Pose(*place.pose)
            for place in fleet.chargers or load_world(scenario.world).chargers
        }
        choices = Choices(
            fleet.decision,
            fleet.cost_model,
            fleet.bid_timeout,
            fleet.stand_by,
            ChargingPlan(self._chargers, fleet.battery),
        )
        posts = [(planned.after, planned.task) for planned in scenario.tasks]
        super().__init__(network, random, posts, choices)
        self._lengths: Callable[[float], PathLengths] = (
            (lambda _: EuclideanLengths())
            if fleet.distance == "euclidean"
            else cache(partial(GridPathLengths, load_map(scenario.map)))
        )
        models = [robot.model for robot in fleet.robots] if fleet.traffic == "planned" else []
        bodies = SimulatedBodies(scenario.world, seed, scenario.map, models, fleet.zones)
        self.simulation = bodies.simulation
        for robot in fleet.robots:
            self._add(robot, bodies)

    def path_lengths(self) -> Callable[[float], PathLengths]:
        """Return a function that gives path lengths for a radius [m]; all nodes share them."""
        return self._lengths

    def freeze(self, name: str, seconds: float) -> None:
        """Let a node's process stand still for a while [s]; its robot drives on."""
        host = self.network.hosts[name]
        if not host.up or host.frozen:
            return
        host.frozen = True
        generation = host.generation

        def go_on(_: object) -> None:
            if host.generation == generation:
                host.thaw()

        self.network.schedule(seconds, None, go_on)

    def _add(self, robot: FleetRobot, bodies: SimulatedBodies) -> None:
        text = model_path(robot.model).read_text(encoding="utf-8")
        characteristics = characteristics_from(yaml.safe_load(text))
        host, network = self.network.hosts[robot.name], self.network
        driven = bodies.add(
            robot, lambda delay, action: network.schedule(delay, None, lambda _: action())
        )
        body = DrivenBody(
            host,
            driven,
            Pose(*robot.pose),
            TrueBattery(characteristics),
            self.ledger,
            self._chargers.values(),
        )
        self.add(TrialRobot(robot.name, characteristics, body))


class DrivenBody:
    """Wheels, arm and battery of one robot in the simulator; see `architectures.trial.TrialBody`.

    Args:
        host: The process that drives it; it hears how steps end.
        driven: The body in the simulator.
        pose: Where it stands [map frame].
        battery: What it draws from.
        ledger: Notes what is done.
        chargers: A robot that stands at one of these charges [map frame].

    Attributes:
        pose: Where it is [map frame].
        battery: What it really has.
        moved: Called on the host with the pose, ten times a second.
    """

    def __init__(
        self,
        host: Host,
        driven: SimulatedBody,
        pose: Pose,
        battery: TrueBattery,
        ledger: Ledger,
        chargers: Collection[Pose],
    ) -> None:
        self.pose = pose
        self.battery = battery
        self.moved: Callable[[Pose], None] = lambda _: None
        self._host = host
        self._driven = driven
        self._ledger = ledger
        self._chargers = chargers
        self._step: TaskStep | None = None
        self._distance = 0.0  # driven in this step [m]
        driven.battery, driven.load, driven.tell = battery, self._load, self._tell

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self._step, self._distance = step, 0.0

        def end(result: CommandResult) -> None:
            self._step = None
            # A robot that does not know that it has arrived drives there again, and is there.
            was_there = step.kind is StepKind.MOVE and self._distance < _THERE
            if result.state is CommandState.SUCCEEDED and not was_there:
                self._ledger.note(step, self._host.network.now)
            self._on_host(done, result)

        self._driven.start(step, end)

    def cancel(self) -> None:
        """Stop."""
        self._step = None
        self._driven.cancel()

    def _load(self) -> float:
        return self._ledger.load_during(self._step) if self._step is not None else 0.0

    def _tell(self, pose: Pose, distance: float) -> None:
        self.pose = pose
        self._distance += distance
        if distance < _STILL and any(pose.distance_to(place) <= NEAR for place in self._chargers):
            self.battery.charge(TOLD * STEP)
        self._on_host(self.moved, pose)

    def _on_host(self, action: Callable[..., None], argument: object) -> None:
        """Call a function in the robot's process, if that lives."""
        if self._host.up:
            self._host.network.schedule(0.0, self._host, action, argument)
