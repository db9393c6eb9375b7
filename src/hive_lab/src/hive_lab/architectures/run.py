# SPDX-License-Identifier: BSD-3-Clause
"""Lets one architecture work through a trial, and says what that took."""

from __future__ import annotations

import math
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_lab.architectures.hall_trial import PROBED_AT, HallTrial
from hive_lab.architectures.kinds import ARCHITECTURES
from hive_lab.architectures.trial import OPERATOR, WARM_UP

if TYPE_CHECKING:
    from collections.abc import Mapping

_LOOK = 1.0  # time between two looks at what is done [s]
_LIMIT = 3600.0  # whatever is not done by then counts as not done [s]
_STALLED = 300.0  # a fleet that has done nothing for so long will do no more [s]
_AFTERWARDS = 60.0  # how much longer tasks that are done again are waited for [s]


class Condition(NamedTuple):
    """What goes wrong.

    Attributes:
        killed: Whether the coordinator's process is killed at `PROBED_AT`, for good.
        loss: Share of the messages between two nodes that are lost.
    """

    killed: bool = False
    loss: float = 0.0


CONDITIONS: Mapping[str, Condition] = MappingProxyType(
    {"usual": Condition(), "killed": Condition(killed=True), "loss": Condition(loss=0.2)}
)
"""What goes wrong, by name."""


class Outcome(NamedTuple):
    """What one run took.

    Attributes:
        not_done: How many tasks were not done.
        done_twice: How many were done more than once.
        time_to_done: From posting until done, mean over the tasks that were done [s].
        time_to_done_95: The same, 95th percentile [s].
        makespan: From the first post until the last task was done [s].
        energy: What all robots drew until then, for each task that was done [J].
        answer: From posting until the operator heard that the fleet has the task, the longest [s].
        unanswered: How many were posted of which the operator never heard.
        messages: What all nodes heard from others, for each task.
        bytes: Size of these, for each task.
        busiest: Processor time of the node that took most, for each task [s].
        others: Processor time of each other node, median, for each task [s].
        all: Processor time of all nodes, for each task [s].
        posted: When each task was posted [s after the first].
        ended: When each that was done was done for the first time, sorted [s after the first].
    """

    not_done: int
    done_twice: int
    time_to_done: float
    time_to_done_95: float
    makespan: float
    energy: float
    answer: float
    unanswered: int
    messages: float
    bytes: float
    busiest: float
    others: float
    all: float
    posted: tuple[float, ...]
    ended: tuple[float, ...]


def run(architecture: str, robots: int, condition: str, seed: int) -> Outcome:
    """Run one architecture with one fleet.

    Args:
        architecture: A name of `ARCHITECTURES`.
        robots: How many.
        condition: A name of `CONDITIONS`.
        seed: Of everything that is drawn.
    """
    _warm_up()
    return _measure(architecture, robots, CONDITIONS[condition], seed)


@cache
def _warm_up() -> None:
    """Have everything imported, compiled and computed that all nodes of a process share."""
    for name in ARCHITECTURES:
        _measure(name, 4, Condition(), 0)


def _measure(architecture: str, robots: int, goes_wrong: Condition, seed: int) -> Outcome:
    kind = ARCHITECTURES[architecture]
    trial = HallTrial(robots, seed, goes_wrong.loss, choices=kind.choices)
    network, ledger = trial.network, trial.ledger
    fleet = kind.put_into(trial)
    trial.begin(fleet)
    if goes_wrong.killed:
        network.run(WARM_UP + PROBED_AT)
        trial.kill(fleet.coordinator)
    count, last = 0, network.now
    while not ledger.is_all_done and network.now < min(WARM_UP + _LIMIT, last + _STALLED):
        network.run(network.now + _LOOK)
        if len(ledger.done) > count:
            count, last = len(ledger.done), network.now
    accounts = [each for name, each in network.accounts.items() if name != OPERATOR]
    spent = sorted(each.spent for each in accounts)
    messages = sum(each.messages for each in accounts)
    size = sum(each.size for each in accounts)
    energy = sum(body.drawn for body in trial.bodies.values())
    network.run(network.now + _AFTERWARDS)
    tasks = len(trial.posts)
    times = ledger.times_to_done or [math.nan]
    ended = sorted(first - WARM_UP for first, *_ in ledger.done.values())
    answers = [at - ledger.posted[task_id] for task_id, at in trial.answered.items()]
    return Outcome(
        not_done=tasks - len(ledger.done),
        done_twice=ledger.done_twice,
        time_to_done=float(np.mean(times)),
        time_to_done_95=float(np.quantile(times, 0.95)),
        makespan=ended[-1] if ended else math.nan,
        energy=energy / max(1, len(ended)),
        answer=max(answers, default=math.nan),
        unanswered=tasks - len(answers),
        messages=messages / tasks,
        bytes=size / tasks,
        busiest=spent[-1] / tasks,
        others=float(np.median(spent[:-1])) / tasks,
        all=sum(spent) / tasks,
        posted=tuple(at - WARM_UP for at in ledger.posted.values()),
        ended=tuple(ended),
    )
