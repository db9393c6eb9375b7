# SPDX-License-Identifier: BSD-3-Clause
"""What AGVs that speak VDA 5050 cost: their agents, the broker, and the time that an order takes.

Three processes: the AGVs, simulated, each with a connection of its own; their agents, all in one;
and the broker. All AGVs drive from place to place of a hall, and each tells its state ten times a
second.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hive_lab.agvs.dispatch import Dispatch
from hive_lab.agvs.yard import Yard
from hive_lab.bench.registry import BenchResult
from hive_lab.bench.usage import usage_of
from vda5050.mqtt.local_broker import free_port, local_broker

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext
    from multiprocessing.queues import Queue

AGVS = 20
STATE_PERIOD = 0.1  # [s]
_UNDER_WAY = 10.0  # time until all AGVs drive [s]
_SECONDS = 60.0  # measured time [s, wall clock]
AIMS = {"agents_cpu": 0.5, "agvs_cpu": 0.5, "broker_cpu": 0.5, "order_latency": 0.05}
"""Cores, and seconds."""


def run(robots: int = AGVS, minutes: int = 0) -> BenchResult:
    """Let so many AGVs drive for a minute, or for some.

    Returns:
        `agents_cpu`, `agvs_cpu`, `broker_cpu` [s per s]; `order_latency`, the median from a goal
        of an agent to its order at the AGV, and `order_latency_95` [s]; `states_per_agv` [1/s];
        `orders`, so many new ones were measured; `reached`, goals; `failed`, goals that were not;
        `agents_memory` [MB].
    """
    context = multiprocessing.get_context("forkserver")
    port = free_port()
    with local_broker(port) as broker:
        agvs = _Process(context, _yard, port, robots)
        agents = _Process(context, _dispatch, port, robots)
        pids = {"agvs": agvs.pid, "agents": agents.pid, "broker": broker}
        time.sleep(_UNDER_WAY)
        before, begin = usage_of(pids.values()), time.monotonic()
        time.sleep(60.0 * minutes or _SECONDS)
        after, seconds = usage_of(pids.values()), time.monotonic() - begin
        dispatch = agents.end()
        heard = agvs.end()
    late = [heard[order] - at for order, at in dispatch.given.items() if order in heard]
    figures = {
        f"{name}_cpu": (after[pid].cpu - before[pid].cpu) / seconds for name, pid in pids.items()
    }
    figures |= {
        "order_latency": float(np.median(late)),
        "order_latency_95": float(np.percentile(late, 95)),
        "states_per_agv": dispatch.states / robots / (_UNDER_WAY + seconds),
        "orders": float(len(late)),
        "reached": float(dispatch.reached),
        "failed": float(len(dispatch.failed)),
        "agents_memory": after[pids["agents"]].memory / 1e6,
    }
    return BenchResult(figures, AIMS)


class Seen(NamedTuple):
    """What the agents have seen; see `Dispatch`."""

    given: dict[str, float]
    reached: int
    failed: list[str]
    states: int


class _Process:
    """A process that runs until it is ended, and then tells what it has seen."""

    def __init__(self, context: ForkServerContext, work: Any, port: int, robots: int) -> None:  # noqa: ANN401  (a function of this module)
        self._ended = context.Event()
        self._told: Queue[Any] = context.Queue()
        arguments = (port, robots, self._ended, self._told)
        self._process = context.Process(target=work, args=arguments, daemon=True)
        self._process.start()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid or os.getpid()

    def end(self) -> Any:  # noqa: ANN401  (what the work tells)
        """End it; return what it tells."""
        self._ended.set()
        told = self._told.get(timeout=30.0)
        self._process.join()
        return told


def _yard(port: int, robots: int, ended: Any, told: Queue[Any]) -> None:  # noqa: ANN401  (an event)
    yard = Yard(port, robots, STATE_PERIOD)
    yard.run(ended.is_set)
    told.put(yard.heard)


def _dispatch(port: int, robots: int, ended: Any, told: Queue[Any]) -> None:  # noqa: ANN401  (an event)
    dispatch = Dispatch(port, robots)
    dispatch.run(ended.is_set)
    told.put(Seen(dispatch.given, dispatch.reached, dispatch.failed, dispatch.states))
