# SPDX-License-Identifier: BSD-3-Clause
"""The trials of `bench architectures`: drawn tasks in the hall, and what every node takes."""

from __future__ import annotations

from functools import cache
from random import Random
from typing import TYPE_CHECKING

import numpy as np
import yaml

from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.task import Task, TaskType
from hive_lab.architectures.body import Body
from hive_lab.architectures.grounds import PLACES, NodePathLengths, free_lengths, poses
from hive_lab.architectures.metering import MeteredNetwork, MeteredTalker
from hive_lab.architectures.trial import Choices, Trial, TrialRobot
from robot_description.models import model_path

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from hive_lab.architectures.trial import Architecture

MODELS = ("youbot", "mir100", "fetch", "ld60")  # every second robot has an arm

AT_ONCE = 2  # tasks for each robot that are posted at once
PER_HOUR = 30.0  # mean rate at which more tasks are posted, for each robot [1/h] ...
MINUTES = 5.0  # ... and for how long [min]
PROBED_AT = 60.0  # one more task is posted then, the moment at which a coordinator is killed [s]

_PAYLOAD = 0.4  # of tasks with an arm [kg]; every arm lifts it
_KINDS = (TaskType.GA, TaskType.GAB, TaskType.GPAB)


@cache
def characteristics(model: str) -> RobotCharacteristics:
    """Return the characteristics of a robot model."""
    return characteristics_from(yaml.safe_load(model_path(model).read_text("utf-8")))


class HallTrial(Trial):
    """A fleet in the hall, whose bodies are reckoned, and whose nodes are metered.

    Args:
        robots: How many.
        seed: Of the tasks, of the drives and of the network.
        loss: Share of the messages between two nodes that are lost.
        posts: What is posted and when [s after the first]; by default drawn.
        choices: How the fleet decides.

    Attributes:
        network: It keeps the accounts.
        bodies: Of the robots, by their names.
    """

    network: MeteredNetwork

    def __init__(
        self,
        robots: int,
        seed: int,
        loss: float = 0.0,
        posts: Sequence[tuple[float, Task]] | None = None,
        choices: Choices | None = None,
    ) -> None:
        random = Random(seed)
        drawn = _draw(robots, seed) if posts is None else posts
        network = MeteredNetwork(random, loss)
        hosts = [network.add_host(f"robot{number}") for number in range(1, robots + 1)]
        super().__init__(network, random, tuple(drawn), choices)
        self.bodies: dict[str, Body] = {}
        starts = poses(PLACES + robots)[PLACES:]
        for index, (host, start) in enumerate(zip(hosts, starts, strict=True)):
            body = characteristics(MODELS[index % len(MODELS)])
            drives = np.random.default_rng((seed, index))
            lengths = free_lengths(body.radius)
            moves = Body(host, body, start, lengths, drives, self.ledger)
            self.bodies[host.name] = moves
            self.add(TrialRobot(host.name, body, moves))

    def boot(self, name: str) -> MeteredTalker:
        """Start the process of a node, with a host of its own if it is no robot."""
        super().boot(name)
        return MeteredTalker(self.network, name)

    def path_lengths(self) -> Callable[[float], PathLengths]:
        """Return a function that gives one node the path lengths for a radius [m]."""
        return cache(lambda radius: NodePathLengths(radius, self.network.charge))

    def begin(self, architecture: Architecture) -> None:
        """Let the architecture get ready, then post the tasks; accounts begin with the first."""
        super().begin(architecture)
        self.network.accounts.clear()
        for body in self.bodies.values():
            body.drawn = 0.0


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
