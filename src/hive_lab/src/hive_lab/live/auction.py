# SPDX-License-Identifier: BSD-3-Clause
"""Measures the auction of a live hive: from posting a task to hearing which robot has it.

A blackboard node and a node for each robot run on a ROS master of their own, with journals on
disk. Fake bases accept every goal and never move. As a baseline, the same number of bare rospy
nodes first exchange the messages of a round on the same master without computing anything. Then
the same hive speaks over ROS, and over Zenoh with certificates, without and with a router.
"""

from __future__ import annotations

import contextlib
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import psutil
import rospy

from blackboard.errors import LiveHiveError
from hive_common.ros.links import PAUSES
from hive_lab.bench.registry import BenchResult
from hive_lab.live import bare_round, bidders
from hive_lab.live.desk import Desk, RosWire, ZenohWire
from hive_lab.live.live_hive import LiveHive, own_master
from hive_lab.live.live_operator import LiveOperator
from hive_lab.live.zenoh_hive import ZenohHive

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

SIZES = (4, 10)  # numbers of robots, unless the user chooses one

AIMS = {
    "robots_10_assigned_median": 0.010,
    "robots_10_seconds_per_task": 1 / 150,
    "robots_10_burst_of_200": 1.0,
    "robots_10_memory_worst": 45.0,
    "robots_100_assigned_median": 0.100,
    "robots_100_seconds_per_task": 1 / 80,
    "robots_100_burst_of_200": 2.5,
    "robots_100_memory_worst": 45.0,
    "zenoh_robots_10_assigned_median": 0.008,
    "zenoh_robots_10_seconds_per_task": 1 / 150,
    "zenoh_robots_100_assigned_median": 0.035,
    "zenoh_robots_100_seconds_per_task": 1 / 100,
}
"""Times [s] and memory [MB]; 150 tasks in a second are a time of 1/150 s for each."""

ROS, ZENOH, ROUTER = "ros", "zenoh", "router"
TRANSPORTS = (ROS, ZENOH, ROUTER)
"""What carries the messages of a hive: ROS, Zenoh, or Zenoh with a router between all. Figures of
the last two begin with their name."""

_ONE_BY_ONE = 100
_BURST = 200
_SUSTAINED = 300
_OPEN_AT_ONCE = 20  # unassigned tasks while the sustained rate is measured
_WARM = 10
_START = 1800.0  # time for all nodes of a large hive to find each other [s, wall clock]
_STARTED_AT_ONCE = 4
_WHOLE_LIST = 300.0  # time for all tasks on a large hive's list to be assigned [s]
_SETTLING = sum(PAUSES)
"""Until then members join, and nodes ask the ROS master now and then for missing links [s]."""
_SIDE = 60.0  # side of the square with the goals, unless the row of robots is longer [m]


def one_by_one(desk: Desk, count: int = _ONE_BY_ONE) -> list[float]:
    """Return the times of tasks that are posted one after the other [s]."""
    times = []
    for _ in range(count):
        since = time.monotonic()
        times.append(desk.wait(desk.post()) - since)
    return times


def burst(desk: Desk, count: int = _BURST) -> float:
    """Return the time until a number of tasks posted at once are assigned [s]."""
    since = time.monotonic()
    return desk.wait(desk.post(count), _WHOLE_LIST) - since


def sustained(desk: Desk, count: int = _SUSTAINED) -> float:
    """Return the time per task with a steady number of unassigned ones [s]."""
    since = time.monotonic()
    tasks: list[str] = []
    for _ in range(count):
        desk.wait_for_fewer(tasks[-_OPEN_AT_ONCE:], _OPEN_AT_ONCE)
        tasks += desk.post()
    return (desk.wait(tasks) - since) / count


def spread(name: str, times: Sequence[float]) -> dict[str, float]:
    """Return median, 95th percentile and worst of some times [s], by name."""
    return {
        f"{name}_median": statistics.median(times),
        f"{name}_95": statistics.quantiles(times, n=20, method="inclusive")[-1],
        f"{name}_worst": max(times),
    }


def measure_bare(robots: int) -> dict[str, float]:
    """Return times of bare rospy nodes [s], as many as there are robots."""
    with _bare_nodes(robots):
        desk = Desk(RosWire("/bare/"), _side(robots))
        _wait_until(lambda: desk.is_heard, f"{robots} bare nodes answer")
        _warm_up(desk)
        figures = spread("bare", one_by_one(desk))
        figures["bare_seconds_per_task"] = sustained(desk)
    return figures


def measure(robots: int, folder: Path, transport: str) -> dict[str, float]:
    """Return times [s], and what a number of robots takes, over one of `TRANSPORTS`.

    The folder is for journals and logs. Processor time [s] and bytes of this machine's loopback
    are those for a task, of all processes and connections, at the sustained rate. A task is posted
    again if no robot has it after five seconds.
    """
    with _hive(robots, folder, transport) as (hive, desk):
        _warm_up(desk)
        desk.clear()
        figures = {f"burst_of_{_BURST}": burst(desk)}
        desk.clear()
        figures |= spread("assigned", one_by_one(desk))
        before = _spent(hive)
        figures["seconds_per_task"] = sustained(desk)
        cpu, sent = (now - then for now, then in zip(_spent(hive), before, strict=True))
        figures |= {"cpu_per_task": cpu / _SUSTAINED, "bytes_per_task": sent / _SUSTAINED}
        figures["posted_again"] = desk.posted_again
        sizes = [_proportional_size(hive.pid_of(hive.node_of(name))) for name in hive.robots]
    return figures | {"memory_median": statistics.median(sizes), "memory_worst": max(sizes)}


def _side(robots: int) -> float:
    """Return the side of the square with the goals [m]."""
    return max(_SIDE, bidders.SPACING * robots)


def _spent(hive: LiveHive) -> tuple[float, float]:
    """Return the processor time of a hive's processes [s], and what loopback has carried [B]."""
    times = [psutil.Process(pid).cpu_times() for pid in hive.pids()]
    sent = psutil.net_io_counters(pernic=True)["lo"].bytes_sent
    return sum(each.user + each.system for each in times), float(sent)


def _warm_up(desk: Desk) -> None:
    """Post until all nodes have found each other."""
    for _ in range(_WARM):
        with contextlib.suppress(LiveHiveError):
            desk.wait(desk.post())


def _wait_until(condition: Any, what: str, patience: float = _START) -> None:  # noqa: ANN401
    end = time.monotonic() + patience
    while not condition():
        if time.monotonic() > end:
            raise LiveHiveError(f"not within {patience:.0f} s: {what}")
        time.sleep(0.1)


def _proportional_size(pid: int) -> float:
    """Return a process's proportional set size [MB]."""
    return float(psutil.Process(pid).memory_full_info().pss) / 1e6


@contextlib.contextmanager
def _bare_nodes(robots: int) -> Iterator[None]:
    roles = [("ask", str(robots)), *[("answer",)] * robots]
    with contextlib.ExitStack() as stack:
        for role in roles:
            stack.enter_context(_module(bare_round, *role))
        yield


@contextlib.contextmanager
def _module(module: ModuleType, *arguments: str) -> Iterator[None]:
    """Run a module of this package in a process of its own."""
    process = subprocess.Popen(  # noqa: S603  (our own nodes)
        [sys.executable, "-m", module.__name__, *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.kill()
        process.wait()


def _hive(
    robots: int, folder: Path, transport: str
) -> contextlib.AbstractContextManager[tuple[LiveHive, Desk]]:
    if transport == ROS:
        return _over_ros(robots, folder)
    return _over_zenoh(robots, folder, has_router=transport == ROUTER)


@contextlib.contextmanager
def _over_ros(robots: int, folder: Path) -> Iterator[tuple[LiveHive, Desk]]:
    """Run a hive in a namespace of its own, once all of it answers and has settled.

    Nobody else than the desk listens to it then, as with the bare nodes.
    """
    names = _names(robots)
    hive = LiveHive(folder / f"ros-{robots}", f"/hive{robots}/", names)
    with contextlib.ExitStack() as stack:
        stack.callback(hive.end)
        operator = LiveOperator(hive.namespace, hive.members)
        stack.enter_context(_bidders(hive))
        hive.start_all()
        operator.demand(operator.all_answer, f"{robots} robots answer", _START)
        operator.close()
        time.sleep(_SETTLING)
        desk = Desk(RosWire(hive.namespace), _side(robots))
        _wait_until(lambda: desk.is_heard, "the hive is connected to the desk")
        yield hive, desk


@contextlib.contextmanager
def _over_zenoh(robots: int, folder: Path, *, has_router: bool) -> Iterator[tuple[LiveHive, Desk]]:
    """Run the same hive over Zenoh, once all robots are heard."""
    name = f"{ROUTER if has_router else ZENOH}{robots}"
    hive = ZenohHive(folder / name, f"/{name}/", _names(robots), has_router=has_router)
    with contextlib.ExitStack() as stack:
        stack.callback(hive.end)
        stack.enter_context(_bidders(hive))
        hive.start_router()
        hive.start(hive.blackboard)
        wire = ZenohWire(hive)
        stack.callback(wire.close)
        # One machine that opens thousands of encrypted connections at once opens none in time.
        for first in range(0, robots, _STARTED_AT_ONCE):
            started = hive.robots[first : first + _STARTED_AT_ONCE]
            for name in started:
                hive.start(hive.node_of(name))
            wire.wait_for_robots(started, _START)
        time.sleep(_SETTLING)
        desk = Desk(wire, _side(robots))
        _wait_until(lambda: desk.is_heard, "the hive is connected to the desk")
        yield hive, desk


def _names(robots: int) -> list[str]:
    return [f"robot{number + 1}" for number in range(robots)]


def _bidders(hive: LiveHive) -> contextlib.AbstractContextManager[None]:
    """Run the bases of a hive's robots."""
    return _module(bidders, *(f"{hive.namespace}{name}" for name in hive.robots))


def run(robots: int = 0, transport: str = "") -> BenchResult:
    """Measure a number of robots, or all `SIZES` if it is 0; see `measure` and `AIMS`.

    All transports are measured, one after the other, or only the one that is named.
    """
    figures: dict[str, float] = {}
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        stack.enter_context(own_master(folder))
        rospy.init_node("bench_auction", anonymous=True, disable_signals=True)
        stack.callback(rospy.signal_shutdown, "what follows ends the master")
        for size in (robots,) if robots else SIZES:
            figures |= _named(f"robots_{size}", measure_bare(size))
            for each in (transport,) if transport else TRANSPORTS:
                name = f"robots_{size}" if each == ROS else f"{each}_robots_{size}"
                figures |= _named(name, measure(size, folder, each))
    return BenchResult(figures, {k: v for k, v in AIMS.items() if k in figures})


def _named(name: str, figures: dict[str, float]) -> dict[str, float]:
    """Return figures, rounded and with a name before theirs, and tell them."""
    found = {each: round(value, 5) for each, value in figures.items()}
    sys.stderr.write(f"{name}: {found}\n")
    return {f"{name}_{each}": value for each, value in found.items()}
