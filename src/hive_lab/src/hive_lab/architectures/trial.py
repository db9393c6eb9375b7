# SPDX-License-Identifier: BSD-3-Clause
"""A fleet with its tasks, into which an architecture is put to be measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from random import Random
from typing import TYPE_CHECKING, Protocol

import numpy as np
import yaml

from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.talker import BB_VOTE, NEW_TASK, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_lab.architectures.body import Body
from hive_lab.architectures.grounds import PLACES, NodePathLengths, free_lengths, poses
from hive_lab.architectures.ledger import Ledger
from hive_lab.architectures.metering import MeteredNetwork, MeteredTalker
from robot_description.models import model_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.record import TaskUpdate
    from hive_lab.fault_schedules.faulty_network import Host

MODELS = ("youbot", "mir100", "fetch", "ld60")  # every second robot has an arm

OPERATOR = "operator"
WARM_UP = 10.0  # time until the first task is posted [s]

AT_ONCE = 2  # tasks for each robot that are posted at once
PER_HOUR = 30.0  # mean rate at which more tasks are posted, for each robot [1/h] ...
MINUTES = 5.0  # ... and for how long [min]
PROBED_AT = 60.0  # one more task is posted then, the moment at which a coordinator is killed [s]

_REPEAT = 1.5  # a task that nobody has answered is posted again after this time [s]
_PATIENCE = 5  # posts to one node before the operator turns to another
_PAYLOAD = 0.4  # of tasks with an arm [kg]; every arm lifts it
_KINDS = (TaskType.GA, TaskType.GAB, TaskType.GPAB)


@cache
def characteristics(model: str) -> RobotCharacteristics:
    """Return the characteristics of a robot model."""
    return characteristics_from(yaml.safe_load(model_path(model).read_text("utf-8")))


@dataclass(frozen=True)
class TrialRobot:
    """A robot before anybody drives it."""

    name: str
    characteristics: RobotCharacteristics
    host: Host
    body: Body


class Architecture(Protocol):
    """A way to build a fleet manager."""

    @property
    def coordinator(self) -> str:
        """The name of the node that coordinates most now."""

    def receivers(self, random: Random) -> Sequence[str] | None:
        """Return which nodes a task may be posted to, one after the other; None means all."""


class Trial:
    """A fleet in the hall.

    Args:
        robots: How many.
        seed: Of the tasks, of the drives and of the network.
        loss: Share of the messages between two nodes that are lost.
        posts: What is posted and when [s after the first]; by default drawn.

    Attributes:
        posts: The same.
        network: All of them are on it.
        robots: By their names.
        ledger: What they have done.
        answered: When the operator first heard of each task, by its id [s].
    """

    def __init__(
        self,
        robots: int,
        seed: int,
        loss: float = 0.0,
        posts: Sequence[tuple[float, Task]] | None = None,
    ) -> None:
        self.random = Random(seed)
        self.network = MeteredNetwork(self.random, loss)
        self.answered: dict[str, float] = {}
        self.posts = tuple(_draw(robots, seed) if posts is None else posts)
        self.ledger = Ledger(task for _, task in self.posts)
        self.robots: dict[str, TrialRobot] = {}
        starts = poses(PLACES + robots)[PLACES:]
        for index, start in enumerate(starts):
            name = f"robot{index + 1}"
            body = characteristics(MODELS[index % len(MODELS)])
            host = self.network.add_host(name)
            drives = np.random.default_rng((seed, index))
            lengths = free_lengths(body.radius)
            moves = Body(host, body, start, lengths, drives, self.ledger)
            self.robots[name] = TrialRobot(name, body, host, moves)
        self._operator = self.network.add_host(OPERATOR)
        self._operator.boot()
        self._operator.handlers[TASK_STATE] = [self._hear]

    def boot(self, name: str) -> MeteredTalker:
        """Start the process of a node, with a host of its own if it is no robot."""
        host = self.network.hosts.get(name) or self.network.add_host(name)
        host.boot()
        host.handlers[BB_VOTE] = []  # like members, it gets only what is meant for it
        return MeteredTalker(self.network, name)

    def path_lengths(self) -> Callable[[float], NodePathLengths]:
        """Return a function that gives one node the path lengths for a radius [m]."""
        return cache(lambda radius: NodePathLengths(radius, self.network.charge))

    def begin(self, architecture: Architecture) -> None:
        """Let the architecture get ready, then post the tasks; accounts begin with the first."""
        self.network.run(WARM_UP)
        self.network.accounts.clear()
        for each in self.robots.values():
            each.body.drawn = 0.0
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


def _draw(robots: int, seed: int) -> Iterator[tuple[float, Task]]:
    """Yield what is posted and when [s after the first]."""
    random = np.random.default_rng((seed, robots))
    later = random.exponential(3600.0 / (PER_HOUR * robots), size=100 * robots).cumsum()
    arrivals = [PROBED_AT, *(float(at) for at in later if at < 60.0 * MINUTES)]
    times = [0.0] * (AT_ONCE * robots) + sorted(arrivals)
    places = poses(PLACES)
    for number, at in enumerate(times, start=1):
        kind = _KINDS[random.integers(len(_KINDS))]
        chosen = random.choice(PLACES, size=kind.goals_needed, replace=False)
        goals = tuple(places[place] for place in chosen)
        yield at, Task(f"T{number}", kind, goals, payload=_PAYLOAD if kind.picks else 0.0)
