# SPDX-License-Identifier: BSD-3-Clause
"""A fleet with its tasks, into which an architecture is put to be measured."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

from blackboard.domain.settings import STANDING_BY, BlackboardSettings
from blackboard.domain.talker import BB_VOTE, NEW_TASK, TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.robot.charging import ChargingPlan
from hive_lab.architectures.ledger import Ledger
from hive_lab.fault_schedules.faulty_network import HostTalker

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from random import Random

    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import TaskUpdate
    from blackboard.domain.task import Task, TaskStep
    from blackboard.robot.executor import CommandResult
    from hive_common.pose import Pose
    from hive_lab.fault_schedules.faulty_network import FaultyNetwork
    from hive_lab.fleets.true_battery import TrueBattery

OPERATOR = "operator"
WARM_UP = 10.0  # time until the first task is posted [s]

_REPEAT = 1.5  # a task that nobody has answered is posted again after this time [s]
_PATIENCE = 5  # posts to one node before the operator turns to another


@dataclass(frozen=True)
class Choices:
    """How a fleet decides, as its fleet file says it.

    Attributes:
        decision: Of the hive; the other architectures decide in their own ways.
        cost_model: How robots work out what a task costs them, and what plans minimize.
        bid_timeout: How long an auction waits for bids at most [s].
        stand_by: How many robots, the first ones, can carry the hive's blackboard.
        charging: Where and when the hive's robots charge.
    """

    decision: str = "planned"
    cost_model: str = "latency"
    bid_timeout: float = BlackboardSettings().bid_timeout
    stand_by: int = STANDING_BY
    charging: ChargingPlan = field(default_factory=ChargingPlan)


class TrialBody(Protocol):
    """Wheels, arm and battery of a robot; it does steps as a `blackboard.robot.executor.Command`.

    Attributes:
        pose: Where it is [map frame].
        battery: What it really has.
        moved: Called in the robot's process with the pose when it has changed.
    """

    pose: Pose
    battery: TrueBattery
    moved: Callable[[Pose], None]

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""

    def cancel(self) -> None:
        """Stop."""


@dataclass(frozen=True)
class TrialRobot:
    """A robot before anybody drives it."""

    name: str
    characteristics: RobotCharacteristics
    body: TrialBody


class Architecture(Protocol):
    """A way to build a fleet manager."""

    @property
    def coordinator(self) -> str:
        """The name of the node that coordinates most now."""

    def receivers(self, random: Random) -> Sequence[str] | None:
        """Return which nodes a task may be posted to, one after the other; None means all."""


class Trial(ABC):
    """A fleet, an operator, and what is posted.

    Args:
        network: All of them are on it.
        random: The source of every chance.
        posts: What is posted and when [s after the first].
        choices: How the fleet decides.

    Attributes:
        network, random, posts, choices: The same.
        robots: By their names.
        ledger: What they have done.
        answered: When the operator first heard of each task, by its id [s].
    """

    def __init__(
        self,
        network: FaultyNetwork,
        random: Random,
        posts: Sequence[tuple[float, Task]],
        choices: Choices | None = None,
    ) -> None:
        self.network = network
        self.random = random
        self.posts = posts
        self.choices = choices or Choices()
        self.answered: dict[str, float] = {}
        self.ledger = Ledger(task for _, task in posts)
        self.robots: dict[str, TrialRobot] = {}
        self._operator = network.add_host(OPERATOR)
        self._operator.boot()
        self._operator.handlers[TASK_STATE] = [self._hear]

    def add(self, robot: TrialRobot) -> None:
        """Add a robot, whose host is on the network."""
        self.robots[robot.name] = robot

    @property
    def least_radius(self) -> float:
        """The radius of the smallest robot [m]: where it cannot drive, nobody can."""
        return min(robot.characteristics.radius for robot in self.robots.values())

    def boot(self, name: str) -> HostTalker:
        """Start the process of a node, with a host of its own if it is no robot."""
        host = self.network.hosts.get(name) or self.network.add_host(name)
        host.boot()
        host.handlers[BB_VOTE] = []  # like members, it gets only what is meant for it
        return HostTalker(host, name)

    @abstractmethod
    def path_lengths(self) -> Callable[[float], PathLengths]:
        """Return a function that gives one node the path lengths for a radius [m]."""

    def begin(self, architecture: Architecture) -> None:
        """Let the architecture get ready, then post the tasks."""
        self.network.run(WARM_UP)
        for after, task in self.posts:
            self.network.schedule(after, None, lambda task: self._post(task, architecture), task)

    def kill(self, name: str) -> None:
        """Kill a node's process; a robot stands still then."""
        if name in self.robots:
            self.robots[name].body.cancel()
        self.network.hosts[name].crash()

    def _post(self, task: Task, architecture: Architecture) -> None:
        self.ledger.posted[task.id] = self.network.now
        self._repeat(task, architecture.receivers(self.random), 0)

    def _repeat(self, task: Task, receivers: Sequence[str] | None, times: int) -> None:
        """Post a task, again and again until somebody answers."""
        if task.id in self.answered:
            return
        to = None
        if receivers is not None:
            to = (receivers[(times // _PATIENCE) % len(receivers)],)
        self.network.send(self._operator, NEW_TASK, task, to)
        self.network.schedule(_REPEAT, None, lambda _: self._repeat(task, receivers, times + 1))

    def _hear(self, update: TaskUpdate) -> None:
        if not update.robot_id or update.state is not TaskState.WAITING:
            self.answered.setdefault(update.task_id, self.network.now)
