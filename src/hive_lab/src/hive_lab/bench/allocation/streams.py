# SPDX-License-Identifier: BSD-3-Clause
"""Tasks that arrive over time: their times to done in a hive, and under simple rules."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.cost import measure_for
from blackboard.domain.settings import DECISIONS, BlackboardSettings
from hive_lab.allocation import rules
from hive_lab.allocation.policies import Append, IdleTakesNearest
from hive_lab.allocation.stream import Stream, simulate
from hive_lab.bench.allocation.running import run_hive

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.auction.search.problem import Floats
    from hive_lab.allocation.stream import Policy
    from hive_lab.bench.allocation.instances import Places

_SEED = 1

_FAIR = 5.0  # allowed ratio of the longest to the mean time to done


@dataclass(frozen=True)
class Case:
    """One stream; for `load` see `Stream.poisson`."""

    robots: int
    tasks: int
    load: float

    @property
    def name(self) -> str:
        """Robots x tasks at a load."""
        return f"stream {self.robots}x{self.tasks} load {self.load:g}"


CASES = (Case(10, 200, 0.8), Case(10, 200, 0.9), Case(10, 200, 1.3))

_RULES: Mapping[str, Callable[[], Policy]] = {
    "report": lambda: Append(rules.report),
    "soonest": lambda: Append(rules.soonest),
    "idle": IdleTakesNearest,
}


def measure_streams(largest: Places) -> tuple[dict[str, float], dict[str, float]]:
    """Return figures and aims of all cases; their places are those of the largest instance."""
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for case in CASES:
        places = largest.part(case.robots, case.tasks)
        stream = Stream.poisson(places.instance("bring"), case.load, np.random.default_rng(_SEED))
        taken = {name: simulate(stream, policy()) for name, policy in _RULES.items()}
        for decision in DECISIONS:
            settings = BlackboardSettings(decision=decision, improve_by=measure_for("latency"))
            posted = stream.posted.tolist()
            taken[decision] = run_hive(places, "bring", "latency", settings, posted).done
        for name, times in taken.items():
            figures[f"{case.name} {name} mean"] = float(times.mean())
            figures[f"{case.name} {name} p95"] = float(np.percentile(times, 95))
            figures[f"{case.name} {name} max"] = float(times.max())
        ratios, wanted = _compared(case, taken)
        figures |= {f"{case.name} {name}": value for name, value in ratios.items()}
        aims |= {f"{case.name} {name}": value for name, value in wanted.items()}
    return figures, aims


def _compared(
    case: Case, taken: Mapping[str, Floats]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the ratios with aims, and the aims."""
    ours, mean = taken["planned"], {name: times.mean() for name, times in taken.items()}
    ratios = {"longest over mean": float(ours.max() / ours.mean())}
    aims = {"longest over mean": _FAIR}
    if case.load > 1:
        ratios |= {f"over {name}": mean["planned"] / mean[name] for name in ("report", "idle")}
        aims |= {"over report": 0.71, "over idle": 0.88}
    else:
        ratios["over best rule"] = mean["planned"] / min(mean[name] for name in _RULES)
        aims["over best rule"] = 1.01
    return {name: float(value) for name, value in ratios.items()}, aims
