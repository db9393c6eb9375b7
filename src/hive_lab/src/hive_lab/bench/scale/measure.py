# SPDX-License-Identifier: BSD-3-Clause
"""Measures how the cost of a hive grows with its size: whole hives on virtual time.

A hive is what a fleet file makes of it: a blackboard node, twelve robots that stand by, and
learners. Its robots drive in the hall (`hive_lab.architectures`), and each node is charged for
what it hears and computes. Every robot knows the length of every path, so that the figures are
those of the protocol, the auction and the plans.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from blackboard.domain.talker import BACKUP, BB_ENTRIES, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_lab.architectures.grounds import PLACES, free_lengths, poses
from hive_lab.architectures.hall_trial import HallTrial
from hive_lab.architectures.hive import Hive
from hive_lab.architectures.trial import OPERATOR, WARM_UP, Choices
from hive_lab.bench.kept_runs import KeptRuns
from hive_lab.bench.registry import BenchResult

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.record import TaskUpdate

DECISIONS = ("distributed", "planned")
SIZES = (10, 30, 100, 300, 1000)  # robots

PERIOD = 120.0  # each robot is posted a task so often, on average [s]
_POSTING = 120.0  # for how long tasks are posted [s]
_AFTERWARDS = 10.0  # in which the last tasks are assigned [s]
_IDLE = 20.0  # how long a hive without tasks is watched [s]
_SEED = 1
_KINDS = (TaskType.GA, TaskType.GAB, TaskType.GPAB)
_PAYLOAD = 0.4  # of tasks with an arm [kg]; every arm lifts it


class Cost(NamedTuple):
    """The cost of one hive.

    Attributes:
        idle_messages: What all nodes hear from others in a second without tasks.
        idle_bytes: Size of these.
        idle_heartbeats: Size of the heartbeats among these.
        idle_leader: Processor time of the leader in that second [s].
        messages: What all nodes hear for each task, in a hive at work.
        bytes: Size of these.
        heartbeats: Size of the heartbeats among these.
        changes: Size of the changes of the task list among these.
        leader: Processor time of the leader for each task [s].
        robot: Of each other node, median [s].
        all: Of all nodes together [s].
        load: Share of one processor that the leader needs, 0 to 1 if one is enough.
        not_assigned: Tasks that no robot had in the end.
    """

    idle_messages: float
    idle_bytes: float
    idle_heartbeats: float
    idle_leader: float
    messages: float
    bytes: float
    heartbeats: float
    changes: float
    leader: float
    robot: float
    all: float
    load: float
    not_assigned: float


GROWING = ("idle_messages", "idle_bytes", "idle_leader", "messages", "bytes", "leader", "all")
"""The figures whose growth is told."""


def run(robots: int = 0, resume: Path | None = None) -> BenchResult:
    """Measure hives of all `SIZES`, or of one size, with each of `DECISIONS`.

    Args:
        robots: The only size; 0 for all.
        resume: Where each run is kept.

    Returns:
        By size and decision the figures of `Cost`, and by decision the exponents of `growth`.
        Aims: every task is assigned, and one processor is enough for the leader.
    """
    sizes = (robots,) if robots else SIZES
    names = {
        (decision, size): f"{decision}, {size} robots" for decision in DECISIONS for size in sizes
    }
    kept = KeptRuns(resume)
    # The largest first, so that no processor is left with them in the end.
    kept.all_of({name: (measure, group) for group, name in reversed(names.items())})
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for (decision, size), name in names.items():
        prefix = f"{size}_robots_{decision}"
        figures |= {f"{prefix}_{figure}": value for figure, value in kept[name].items()}
        aims |= {f"{prefix}_not_assigned": 0.0, f"{prefix}_load": 1.0}
    for decision in DECISIONS if len(sizes) > 1 else ():
        costs = {size: kept[names[decision, size]] for size in sizes}
        figures |= {
            f"{decision}_growth_{figure}": value for figure, value in growth(costs).items()
        }
    lost = any(value for name, value in figures.items() if name.endswith("not_assigned"))
    return BenchResult(figures, aims, broken=lost)


def growth(costs: Mapping[int, Mapping[str, float]]) -> dict[str, float]:
    """Return the exponents with which figures grow with the robots: 1 is in proportion to them.

    They are those from the second largest size to the largest, because what grows fastest counts
    for little in a small hive.
    """
    *_, fewer, more = sorted(costs)
    return {
        figure: math.log(costs[more][figure] / costs[fewer][figure]) / math.log(more / fewer)
        for figure in GROWING
    }


def measure(decision: str, robots: int) -> dict[str, Any]:
    """Return the figures of `Cost` of a hive of some robots, which decides in a way."""
    trial = _KnownHall(robots, _SEED, posts=tuple(_posts(robots)), choices=Choices(decision))
    network = trial.network
    hive = Hive(trial)
    assigned: set[str] = set()

    def hear(update: TaskUpdate) -> None:
        if update.state is TaskState.ASSIGNED:
            assigned.add(update.task_id)

    network.hosts[OPERATOR].handlers[TASK_STATE].append(hear)
    network.run(WARM_UP)
    network.accounts.clear()
    network.run(network.now + _IDLE)
    idle = _shares(trial, hive.coordinator, _IDLE)
    trial.begin(hive)
    network.run(network.now + _POSTING + _AFTERWARDS)
    tasks = len(trial.posts)
    cost = _shares(trial, hive.coordinator, tasks)
    return Cost(
        idle_messages=idle["messages"],
        idle_bytes=idle["bytes"],
        idle_heartbeats=idle["heartbeats"],
        idle_leader=idle["leader"],
        **cost,
        load=cost["leader"] * tasks / (_POSTING + _AFTERWARDS),
        not_assigned=float(tasks - len(assigned)),
    )._asdict()


class _KnownHall(HallTrial):
    """The hall, in which nobody has to work out the length of a path."""

    def path_lengths(self) -> Callable[[float], PathLengths]:
        """Return a function that gives one node the path lengths for a radius [m]."""
        return free_lengths


def _shares(trial: HallTrial, leader: str, parts: float) -> dict[str, float]:
    """Return what all nodes but the operator have taken, in equal parts."""
    accounts = {name: each for name, each in trial.network.accounts.items() if name != OPERATOR}
    others = [each.spent for name, each in accounts.items() if name != leader]
    return {
        "messages": sum(each.messages for each in accounts.values()) / parts,
        "bytes": sum(each.size for each in accounts.values()) / parts,
        "heartbeats": sum(each.sizes[BACKUP] for each in accounts.values()) / parts,
        "changes": sum(each.sizes[BB_ENTRIES] for each in accounts.values()) / parts,
        "leader": accounts[leader].spent / parts,
        "robot": float(np.median(others)) / parts,
        "all": sum(each.spent for each in accounts.values()) / parts,
    }


def _posts(robots: int) -> Iterator[tuple[float, Task]]:
    """Yield what is posted and when [s after the first], evenly spread."""
    random = np.random.default_rng((_SEED, robots))
    number = max(1, round(robots * _POSTING / PERIOD))
    for index in range(number):
        kind = _KINDS[random.integers(len(_KINDS))]
        chosen = random.choice(PLACES, size=kind.goals_needed, replace=False)
        goals = tuple(poses(PLACES)[place] for place in chosen)
        payload = _PAYLOAD if kind.picks else 0.0
        yield _POSTING * index / number, Task(f"T{index + 1}", kind, goals, payload=payload)
