# SPDX-License-Identifier: BSD-3-Clause
"""The best known figures of the instances, and the long search that some of them come from.

Run as `python -m hive_lab.bench.allocation.reference SOLVERS TABLE`; see setup/reference.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hive_common.resources import package_folder
from hive_lab.allocation.exact import optimum
from hive_lab.bench.allocation.instances import SIZES, Floor, instances
from hive_lab.bench.allocation.plans import figures, searched

if TYPE_CHECKING:
    from hive_lab.allocation.instance import Instance

OBJECTIVES = ("latency", "makespan", "energy")

_TABLE = "allocation_reference.json"

_LONG_SEARCH = {20: (10, 100_000), 100: (3, 400_000), 1000: (1, 400_000)}
"""How often the long search is run for each instance and objective, with other seeds, and its
rounds, by number of tasks; 10 to 20 s of processor time."""

_MAX_EXACT = 10


def read_best() -> dict[str, dict[str, float]]:
    """Return the least known figure by instance and objective [s] [m]; see `plans.figures`."""
    path = package_folder("hive_lab") / "resource" / _TABLE
    table = json.loads(path.read_text(encoding="utf-8"))["figures"]
    return {
        name: {objective: min(values.values()) for objective, values in found.items()}
        for name, found in table.items()
    }


def best_of(instance: Instance, objective: str) -> tuple[str, float]:
    """Return how a figure was found, `exact` or `search`, and the figure."""
    tasks = len(instance.tasks)
    if tasks <= _MAX_EXACT:
        best = optimum(instance, objective)
        return "exact", best / tasks if objective == "latency" else best
    seeds, rounds = _LONG_SEARCH[tasks]
    plans = (searched(instance, objective, rounds, seed) for seed in range(seeds))
    return "search", min(figures(instance, plan)[objective] for plan in plans)


def make_table(solvers: Path, table: Path) -> None:
    """Add the optimum and the long search to the solvers' figures, and write the table."""
    made: dict[str, Any] = json.loads(solvers.read_text(encoding="utf-8"))
    made["search_rounds"] = {str(tasks): limit for tasks, limit in _LONG_SEARCH.items()}
    floor = Floor()
    for size in SIZES:
        for name, instance in instances(size, floor):
            found = made["figures"].setdefault(name, {})
            for objective in OBJECTIVES:
                how, value = best_of(instance, objective)
                found.setdefault(objective, {})[how] = round(value, 3)
    made["figures"] = dict(sorted(made["figures"].items()))
    table.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    make_table(Path(sys.argv[1]), Path(sys.argv[2]))
