# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives in one process on virtual time, with robots that only pretend to drive.

The hives consist of the real classes. Fakes replace only what lies behind a port of the core:
`Network` and its talkers replace ROS, `TimedCommand` replaces an action server.
"""

from __future__ import annotations

import itertools
import random
from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.bootstrap import new_hive
from blackboard.consensus.journal import MemoryJournal
from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.node import RaftNode
from blackboard.consensus.task_list import TaskList
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.battery import Battery, BatteryModel
from blackboard.domain.characteristics import RobotCharacteristics
from blackboard.domain.record import OrderKind, TaskRecord
from blackboard.domain.settings import (
    BlackboardSettings,
    ControllerSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.domain.talker import (
    BACKUP,
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_ASSIGN,
    TASK_CANCEL,
    TASK_STATE,
)
from blackboard.domain.task import StepKind, TaskState
from blackboard.robot.executor import CommandResult, CommandState, Controller
from blackboard.robot.robot import Robot
from hive_lab.virtual.inline_searcher import InlineSearcher
from hive_lab.virtual.network import LATENCY, Network, NetworkTalker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from blackboard.auction.decision import Decision
    from blackboard.auction.search.searcher import Searcher
    from blackboard.consensus.hive_filter import HiveFilter
    from blackboard.consensus.journal import Journal
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import Order, TaskUpdate
    from blackboard.domain.talker import Talker
    from blackboard.domain.task import Task, TaskStep
    from blackboard.robot.charging import ChargingPlan
    from blackboard.robot.executor import Command
    from hive_common.pose import Pose
    from hive_lab.virtual.network import Call

SMALL_ROBOT = RobotCharacteristics(
    mass=50.0,
    payload=20.0,
    max_speed=1.0,
    friction_coefficient=0.02,
    radius=0.3,
    battery=BatteryModel(
        capacity=20.0, voltage_full=28.0, voltage_empty=22.0, charging_time=3600.0
    ),
    arm_payload=5.0,
    arm_power=100.0,
    pick_duration=5.0,
    place_duration=4.0,
    idle_power=20.0,
)
"""A mobile manipulator; derive others with `dataclasses.replace`."""


def lone_node(talker: Talker) -> RaftNode:
    """Return the Raft node of a blackboard that is its hive's only member."""
    disk = MemoryJournal(new_hive("blackboard#1", "hive1"))
    return RaftNode(talker, "blackboard", RaftSettings(), disk, random.Random(0))


def start_blackboard(
    talker: Talker,
    path_lengths: PathLengths | None = None,
    settings: BlackboardSettings | None = None,
    note: Callable[[Iterable[Decision]], None] = lambda _: None,
    searcher: Searcher | None = None,
) -> None:
    """Start the blackboard of a hive that has no other member."""
    node = lone_node(talker)
    lengths = path_lengths or EuclideanLengths()
    Blackboard(
        talker,
        node,
        lengths,
        settings or BlackboardSettings(),
        note=note,
        searcher=searcher or InlineSearcher(talker),
    ).start()
    node.start()


def make_robot(
    talker: Talker,
    name: str,
    pose: Pose,
    commands: Mapping[StepKind, Command],
    characteristics: RobotCharacteristics = SMALL_ROBOT,
    *,
    battery: Battery | None = None,
    path_lengths: PathLengths | None = None,
    controller: ControllerSettings | None = None,
    settings: RobotSettings | None = None,
    journal: Journal | None = None,
    hive_filter: HiveFilter | None = None,
    charging: ChargingPlan | None = None,
    missing: Callable[[], str] = str,
) -> Robot:
    """Compose a robot of the real classes; what is left out is usual."""
    return Robot(
        talker,
        name,
        characteristics,
        battery or Battery(characteristics.battery),
        path_lengths or EuclideanLengths(),
        Controller(commands, talker.world, controller or ControllerSettings(), missing),
        pose,
        settings or RobotSettings(),
        journal or MemoryJournal(),
        hive_filter,
        charging,
    )


@dataclass
class TimedCommand:
    """Completes every step after a while; see `blackboard.robot.executor.Command`.

    Attributes:
        duration: How long a step takes [s].
        arrive: Called with the goal when a step succeeds.
        results: How the next steps end; later ones succeed.
    """

    network: Network
    duration: Callable[[TaskStep], float]
    arrive: Callable[[Pose], None] = lambda _: None
    results: list[CommandResult] = field(default_factory=list)
    started: list[TaskStep] = field(default_factory=list)
    running: TaskStep | None = None
    _call: Call | None = None

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self.started.append(step)
        self.running = step
        ok = CommandResult(CommandState.SUCCEEDED)
        result = self.results.pop(0) if self.results else ok

        def end() -> None:
            self.running = None
            if result == ok:
                self.arrive(step.goal)
            done(result)

        self._call = self.network.schedule(self.duration(step), end)

    def cancel(self) -> None:
        """Stop."""
        self.running = None
        if self._call is not None:
            self._call.cancel()


class Listener:
    """A minimal leader, just enough for robots to keep working.

    It echoes every status at once, and publishes every reported start. A robot may work for
    `robot_lease` after each status [s].
    """

    def __init__(self, network: Network, robot_lease: float = 3.5) -> None:
        self._network = network
        self._robot_lease = robot_lease
        self._records: dict[str, TaskRecord] = {}
        network.listen(ROBOT_STATUS, self._echo)
        network.listen(TASK_ASSIGN, self._note)
        network.listen(TASK_STATE, self._show)

    def _echo(self, status: RobotStatus) -> None:
        heard = {status.robot_id: status.sent}
        beat = Heartbeat(1, "blackboard", heard=heard, robot_lease=self._robot_lease)
        self._network.send(BACKUP, beat)

    def _note(self, order: Order) -> None:
        if order.kind is OrderKind.ASSIGN:
            self._records[order.task.id] = TaskRecord(
                order.task,
                TaskState.ASSIGNED,
                order.robot_id,
                order.step,
                assignment=order.assignment,
            )

    def _show(self, update: TaskUpdate) -> None:
        record = self._records.get(update.task_id)
        if record is not None and update.state is TaskState.STARTED:
            record = replace(record, state=update.state, step=update.step)
            self._records[update.task_id] = record
            self._network.send(SYNC, TaskList(1, 0, tuple(self._records.values())))


class Hive:
    """A blackboard and some robots on one network.

    By default the network loses nothing, and the blackboard's distances are straight lines.
    `talkers`, `robots` and `commands` (one for each robot) are by name; `decisions` holds what
    the blackboard has decided, oldest first.
    """

    def __init__(
        self,
        settings: BlackboardSettings | None = None,
        network: Network | None = None,
        path_lengths: PathLengths | None = None,
        searcher: Searcher | None = None,
    ) -> None:
        self.network = network or Network()
        self.robots: dict[str, Robot] = {}
        self.commands: dict[str, TimedCommand] = {}
        self.talkers: dict[str, NetworkTalker] = {}
        self._read = 0
        self._updates: dict[str, list[TaskUpdate]] = defaultdict(list)
        self._list: TaskList | None = None
        self.decisions: list[Decision] = []
        talker = self._talker("blackboard")
        start_blackboard(talker, path_lengths, settings, self.decisions.extend, searcher)

    def add_robot(
        self,
        name: str,
        pose: Pose,
        characteristics: RobotCharacteristics = SMALL_ROBOT,
        *,
        path_lengths: PathLengths | None = None,
        charge: float = 1.0,
        cost_model: str = "report",
        charging: ChargingPlan | None = None,
        aging: float = 120.0,
        journal: Journal | None = None,
    ) -> Robot:
        """Add a robot, or restart its process.

        Each step takes 10 s and succeeds, unless the robot's command says otherwise.
        """
        if name in self.robots:
            self.kill(name)
        talker = self._talker(name)
        command = self.commands[name] = TimedCommand(self.network, lambda _: 10.0)
        robot = self.robots[name] = make_robot(
            talker,
            name,
            pose,
            dict.fromkeys(StepKind, command),
            characteristics,
            battery=Battery(characteristics.battery, charge),
            path_lengths=path_lengths,
            settings=RobotSettings(cost_model=cost_model, aging=aging),
            charging=charging,
            journal=journal,
        )
        command.arrive = robot.set_pose
        robot.start()
        self.network.run(10 * LATENCY)
        return robot

    def post(self, *tasks: Task) -> None:
        """Post tasks as an operator does."""
        for task in tasks:
            self.network.send(NEW_TASK, task)

    def cancel(self, task_id: str) -> None:
        """Cancel a task as an operator does."""
        self.network.send(TASK_CANCEL, task_id)

    def kill(self, robot: str) -> None:
        """Kill a robot's process: the robot stands still, deaf and mute."""
        self.talkers[robot].running = False
        self.commands[robot].cancel()
        del self.robots[robot]

    def set_state(self, robot: str, word: str) -> None:
        """Set a robot's state as an operator does."""
        self.network.send(f"{robot}/{SET_STATE}", word)

    def updates(self, task_id: str) -> list[TaskUpdate]:
        """Return every update on a task, in the order heard."""
        self._listen()
        return self._updates[task_id]

    def states(self, task_id: str) -> list[TaskState]:
        """Return the states of a task in order, without repetitions."""
        said = [update.state for update in self.updates(task_id)]
        return [state for state, _ in itertools.groupby(said)]

    def record(self, task_id: str) -> TaskRecord:
        """Return a task's record from the last published task list."""
        self._listen()
        records = self._list.records if self._list else ()
        return next(record for record in records if record.task.id == task_id)

    def all_ended(self, *task_ids: str) -> bool:
        """Return whether every one of these tasks has reached a terminal state."""
        return all(
            any(update.state.is_terminal for update in self.updates(task_id))
            for task_id in task_ids
        )

    def _listen(self) -> None:
        """Read the messages since the last call."""
        said = self.network.heard[self._read :]
        self._read += len(said)
        for topic, message in said:
            if topic == TASK_STATE:
                self._updates[message.task_id].append(message)
            elif topic == SYNC:
                self._list = message

    def _talker(self, member: str) -> NetworkTalker:
        talker = self.talkers[member] = NetworkTalker(self.network, member)
        return talker
