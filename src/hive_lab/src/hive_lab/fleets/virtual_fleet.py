# SPDX-License-Identifier: BSD-3-Clause
"""A whole fleet in one process on virtual time: the hive's real classes, without ROS.

What moves the robots is exchangeable: the simulator with real navigation (`simulated_bodies`), or
an estimate of travel times (`reckoned_bodies`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import yaml

from blackboard.costing.cost import measure_for
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.battery import Battery
from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.settings import BlackboardSettings, RobotSettings
from blackboard.domain.talker import NEW_TASK, ROBOT_STATUS, TASK_COST, TASK_STATE
from blackboard.robot.charging import ChargingPlan
from hive_common.map_file import load_map
from hive_common.pose import Pose
from hive_lab.fleets.true_battery import TrueBattery
from hive_lab.virtual.hive import make_robot, start_blackboard
from hive_lab.virtual.network import Network, NetworkTalker
from robot_description.models import model_path

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.costing.bid_basis import Bids
    from blackboard.domain.bid import Bid
    from blackboard.domain.characteristics import RobotCharacteristics, RobotStatus
    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.task import StepKind, Task
    from blackboard.robot.executor import Command
    from blackboard.robot.robot import Robot
    from fleet_manager.config.fleet_file import Fleet, FleetRobot


class Bodies(Protocol):
    """What moves the robots of a fleet."""

    def command(self, robot: FleetRobot, fleet: VirtualFleet) -> Mapping[StepKind, Command]:
        """Return a robot's command for each kind of step."""


class VirtualFleet:
    """A hive with the robots of a fleet file.

    Args:
        fleet: The robots, and how the hive decides.
        chart: Name or path of the map.
        bodies: What moves the robots.
        chargers: Where a robot stands at each charger, by name, frame map.
        measured: Whether robots measure how full their batteries are instead of reckoning it.
            Their bodies are `SimulatedBodies` then, and nothing charges them.

    Attributes:
        robots, batteries, characteristics, path_lengths: Of each robot, by its name.
        true_batteries: Of each robot that measures its own.
        board_lengths: The path lengths of the blackboard.
        bids: The latest bid of each robot on each task, by (task, robot).
        updates: All updates of each task.
        statuses: The latest of each robot.
    """

    def __init__(
        self,
        fleet: Fleet,
        chart: str,
        bodies: Bodies,
        chargers: Mapping[str, Pose],
        *,
        measured: bool = False,
    ) -> None:
        self.network = Network()
        self.robots: dict[str, Robot] = {}
        self.batteries: dict[str, Battery] = {}
        self.true_batteries: dict[str, TrueBattery] = {}
        self.characteristics: dict[str, RobotCharacteristics] = {}
        self.bids: dict[tuple[str, str], Bid] = {}
        self.updates: dict[str, list[TaskUpdate]] = {}
        self.statuses: dict[str, RobotStatus] = {}
        self.path_lengths: dict[str, GridPathLengths] = {}
        self._on_update: Callable[[TaskUpdate], None] = lambda _: None
        self.grid = load_map(chart)
        self._plan = ChargingPlan(chargers, fleet.battery)
        self._talkers: dict[str, NetworkTalker] = {}
        self._commands: dict[str, Mapping[StepKind, Command]] = {}
        settings = BlackboardSettings(
            decision=fleet.decision,
            improve_by=measure_for(fleet.cost_model),
            bid_timeout=fleet.bid_timeout,
        )
        self.board_lengths = GridPathLengths(self.grid)
        talker = NetworkTalker(self.network, "blackboard")
        start_blackboard(talker, self.board_lengths, settings)
        self.network.listen(TASK_COST, self._note_bids)
        self.network.listen(TASK_STATE, self._note_update)
        self.network.listen(ROBOT_STATUS, self._note_status)
        for entry in fleet.robots:
            body = characteristics_from(yaml.safe_load(model_path(entry.model).read_text("utf-8")))
            self.characteristics[entry.name] = body
            self.batteries[entry.name] = Battery(body.battery)
            if measured:
                true = self.true_batteries[entry.name] = TrueBattery(body)
                self.batteries[entry.name] = true.measured
            self._add(entry, fleet, bodies)

    def _add(self, entry: FleetRobot, fleet: Fleet, bodies: Bodies) -> None:
        talker = self._talkers[entry.name] = NetworkTalker(self.network, entry.name)
        commands = self._commands[entry.name] = bodies.command(entry, self)
        body = self.characteristics[entry.name]
        lengths = self.path_lengths[entry.name] = GridPathLengths(self.grid, body.radius)
        robot = self.robots[entry.name] = make_robot(
            talker,
            entry.name,
            Pose(*entry.pose),
            commands,
            body,
            battery=self.batteries[entry.name],
            path_lengths=lengths,
            settings=RobotSettings(cost_model=fleet.cost_model),
            charging=self._plan,
        )
        robot.start()

    def watch(self, on_update: Callable[[TaskUpdate], None]) -> None:
        """Call a function with every update of a task."""
        self._on_update = on_update

    def post(self, task: Task) -> None:
        """Post a task as an operator does."""
        self.network.send(NEW_TASK, task)

    def kill(self, robot: str) -> None:
        """Kill a robot's process: it stands still, deaf and mute."""
        self._talkers[robot].running = False
        for command in self._commands[robot].values():
            command.cancel()

    def run(self, duration: float) -> None:
        """Let time pass [s]; drop the recorded messages, which would fill the memory in a day."""
        self.network.run(duration)
        self.network.sent.clear()
        self.network.heard.clear()

    def _note_bids(self, bids: Bids) -> None:
        for bid in bids.bids:
            self.bids[bid.task_id, bid.robot_id] = bid

    def _note_update(self, update: TaskUpdate) -> None:
        self.updates.setdefault(update.task_id, []).append(update)
        self._on_update(update)

    def _note_status(self, status: RobotStatus) -> None:
        self.statuses[status.robot_id] = status
