# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that arrive over time: their times to done under each policy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_lab.allocation import rules
from hive_lab.allocation.instance import Instance
from hive_lab.allocation.objectives import OBJECTIVES
from hive_lab.allocation.policies import Append, IdleTakesNearest, Reallocation
from hive_lab.allocation.stream import Stream, simulate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_lab.allocation.stream import Policy
    from hive_lab.allocation.timetable import Floats

_SEED = 1

_AGING = 120.0  # waiting time that doubles a task's weight [s]: about two tasks of the warehouse
_FAIR = 5.0  # allowed ratio of the longest to the mean time to done, at load 0.9 with aging


@dataclass(frozen=True)
class Case:
    """One stream; for `load` see `Stream.poisson`.

    Attributes:
        afresh: Whether to compare with the full re-auction at every event, which is slow.
    """

    robots: int
    tasks: int
    load: float
    afresh: bool

    @property
    def name(self) -> str:
        """Robots x tasks at a load."""
        return f"stream {self.robots}x{self.tasks} load {self.load:g}"


CASES = (
    Case(10, 200, 0.8, afresh=True),
    Case(10, 200, 0.9, afresh=True),
    Case(10, 200, 1.3, afresh=True),
    Case(50, 1000, 0.8, afresh=False),
    Case(50, 1000, 1.3, afresh=False),
)


def measure_streams(largest: Instance) -> tuple[dict[str, float], dict[str, float]]:
    """Return figures and aims of all cases; their tasks come from the largest instance."""
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for case in CASES:
        instance = _part(largest, case.robots, case.tasks)
        stream = Stream.poisson(instance, case.load, np.random.default_rng(_SEED))
        taken = {name: simulate(stream, policy) for name, policy in _policies(case).items()}
        for name, times in taken.items():
            figures[f"{case.name} {name} mean"] = float(times.mean())
            figures[f"{case.name} {name} p95"] = float(np.percentile(times, 95))
            figures[f"{case.name} {name} max"] = float(times.max())
        ratios, wanted = _compared(case, taken)
        figures |= {f"{case.name} {name}": value for name, value in ratios.items()}
        aims |= {f"{case.name} {name}": value for name, value in wanted.items()}
    return figures, aims


def _part(whole: Instance, robots: int, tasks: int) -> Instance:
    """Return the first robots and tasks of an instance."""
    rows = np.concatenate([np.arange(tasks), len(whole.tasks) + np.arange(robots)])
    return Instance.plain(whole.way[np.ix_(rows, np.arange(tasks))], whole.tasks.inner[:tasks])


def _policies(case: Case) -> Mapping[str, Policy]:
    latency = OBJECTIVES["latency"]
    policies: dict[str, Policy] = {
        "report": Append(rules.report),
        "soonest": Append(rules.soonest),
        "idle": IdleTakesNearest(),
        "improving": Reallocation(latency, np.random.default_rng(_SEED)),
        "aging": Reallocation(latency, np.random.default_rng(_SEED), aging=_AGING),
    }
    if case.afresh:
        random = np.random.default_rng(_SEED)
        policies["afresh"] = Reallocation(latency, random, rounds=30, afresh=True)
    return policies


def _compared(
    case: Case, taken: Mapping[str, Floats]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the ratios with aims, and the aims."""
    ours, mean = taken["improving"], {name: times.mean() for name, times in taken.items()}
    ratios: dict[str, float] = {}
    aims: dict[str, float] = {}
    if case.load > 1:
        ratios |= {f"over {name}": mean["improving"] / mean[name] for name in ("report", "idle")}
        aims |= {"over report": 0.90, "over idle": 0.80}
        if case.afresh:
            fresh = taken["afresh"]
            ratios["p95 over afresh"] = float(np.percentile(ours, 95) / np.percentile(fresh, 95))
            ratios["max over afresh"] = float(ours.max() / fresh.max())
            aims |= {"p95 over afresh": 1.2, "max over afresh": 1.2}
    else:
        ratios["over best"] = mean["improving"] / min(mean.values())
        aims["over best"] = 1.02
        ratios["longest over mean with aging"] = taken["aging"].max() / mean["aging"]
        aims["longest over mean with aging"] = _FAIR
    return {name: float(value) for name, value in ratios.items()}, aims
