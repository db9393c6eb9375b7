# SPDX-License-Identifier: BSD-3-Clause
"""The figures of a plan, and a plan made by the auction and the search."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from hive_lab.allocation.improvement import improve
from hive_lab.allocation.objectives import OBJECTIVES
from hive_lab.allocation.plan import to_order
from hive_lab.allocation.sequential import auction
from hive_lab.allocation.timetable import Book, Timetable

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hive_lab.allocation.improvement import Search
    from hive_lab.allocation.instance import Instance
    from hive_lab.allocation.plan import Plan

SEED = 1


def figures(instance: Instance, plan: Plan) -> dict[str, float]:
    """Return the figures of a plan.

    Returns:
        `energy`, the path length of all robots [m]; `makespan` [s]; `latency` and `p95`, mean and
        95th percentile of the time to done [s].
    """
    book = Book(instance)
    table = Timetable(book, np.arange(len(plan)), to_order(plan, book.nothing))
    done = table.done[:, 1:][table.order != book.nothing]
    if done.size != len(instance.tasks):
        raise ValueError(f"{done.size} tasks on the lists, {len(instance.tasks)} to be given out")
    return {
        "energy": float(table.energy.sum()),
        "makespan": float(done.max()),
        "latency": float(done.mean()),
        "p95": float(np.percentile(done, 95)),
    }


def searched(
    instance: Instance,
    objective: str,
    plan: Plan | None,
    seconds: float,
    search: Search | None = None,
) -> Plan:
    """Return the plan of auction and search within a processor time [s]."""
    end = time.process_time() + seconds
    known = OBJECTIVES[objective]
    begun = plan or auction(instance, known)
    random = np.random.default_rng(SEED)
    return improve(instance, known, begun, random, lambda: time.process_time() < end, search)


def mean_and_worst(name: str, ratios: Iterable[float]) -> dict[str, float]:
    """Return mean and worst of some ratios, as figures with names."""
    values = list(ratios)
    return {f"{name} mean": float(np.mean(values)), f"{name} worst": max(values)}
