# SPDX-License-Identifier: BSD-3-Clause
"""Counts odd messages that a hive at work cannot stand: those that end a process or stop it."""

from __future__ import annotations

import time
from itertools import repeat

import click

from hive_lab.bench.registry import BenchResult
from hive_lab.bench.workers import workers
from hive_lab.fuzz.run import Found, fuzz

MESSAGES = 100_000
_PIECE = 2000  # messages of one process at a time


def run(messages: int = MESSAGES, seed: int = 1) -> BenchResult:
    """Deliver odd messages to hives on virtual time.

    Args:
        messages: How many; rounded up to whole pieces.
        seed: The same seed gives the same run.

    Returns:
        How many messages were delivered, how many the border refuses and how many it accepts; how
        many failures there were; how many hives did the next good task; the time on the wall [s].
        Aim: no failures.
    """
    began, found = time.perf_counter(), Found()
    seeds = range(seed, seed + -(-messages // _PIECE))
    with workers() as pool:
        for each in pool.map(fuzz, seeds, repeat(_PIECE)):
            found.add(each)
            click.echo("\n".join((f"{found.messages.total()} messages", *each.failures)), err=True)
    failures = float(len(found.failures))
    figures = {
        "messages": float(found.messages.total()),
        "refused": float(found.refused),
        "accepted": float(found.messages.total() - found.refused),
        "failures": failures,
        "tasks_done": float(found.done),
        "took": time.perf_counter() - began,
    }
    return BenchResult(figures, {"failures": 0.0}, failures > 0)
