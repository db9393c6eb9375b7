# SPDX-License-Identifier: BSD-3-Clause
"""The figures of a plan, and a plan made by the auction and the search."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.search.improvement import Improvement
from blackboard.auction.search.objectives import OBJECTIVES
from blackboard.auction.search.plan import to_order
from blackboard.auction.search.sequential import Sequential
from blackboard.auction.search.timetable import Book, Timetable
from blackboard.costing.cost import measure_for

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blackboard.auction.search.improvement import Search
    from blackboard.auction.search.plan import Plan
    from hive_lab.allocation.instance import Instance

SEED = 1


def figures(instance: Instance, plan: Plan) -> dict[str, float]:
    """Return the figures of a plan.

    Returns:
        `energy`, the path length of all robots [m]; `makespan` [s]; `latency` and `p95`, mean and
        95th percentile of the time to done [s].
    """
    book = Book(instance.problem())
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


def auctioned(instance: Instance, objective: str) -> Plan:
    """Return the plan of an auction of all tasks."""
    auction = Sequential(
        Book(instance.problem()),
        OBJECTIVES[measure_for(objective)],
        tuple(() for _ in instance.robots.ready),
    )
    while auction.step():
        pass
    return tuple(map(tuple, auction.lists))


def searched(
    instance: Instance,
    objective: str,
    plan: Plan | None,
    seconds: float,
    search: Search | None = None,
) -> Plan:
    """Return the plan of auction and search within a processor time [s].

    `objective` is the name of a cost model.
    """
    end = time.process_time() + seconds
    begun = plan or auctioned(instance, objective)
    random = np.random.default_rng(SEED)
    measure = OBJECTIVES[measure_for(objective)]
    improvement = Improvement(Book(instance.problem()), measure, begun, random, search)
    while time.process_time() < end:
        improvement.step()
    improvement.note_best()
    return improvement.plan


def mean_and_worst(name: str, ratios: Iterable[float]) -> dict[str, float]:
    """Return mean and worst of some ratios, as figures with names."""
    values = list(ratios)
    return {f"{name} mean": float(np.mean(values)), f"{name} worst": max(values)}
