# SPDX-License-Identifier: BSD-3-Clause
"""Measures the auction on real ROS: from posting a task to hearing which robot has it.

A blackboard node and a node for each robot run on a ROS master of their own, with journals on
disk. Fake bases accept every goal and never move. As a baseline, the same number of bare rospy
nodes first exchange the messages of a round on the same master without computing anything.
"""

from __future__ import annotations

import contextlib
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import blackboard.msg as bb_msgs
import psutil
import rospy
from std_msgs.msg import String

from blackboard.errors import LiveHiveError
from hive_common.ros.links import PAUSES
from hive_lab.bench.registry import BenchResult
from hive_lab.live import bare_round, bidders
from hive_lab.live.live_hive import LiveHive, own_master
from hive_lab.live.live_operator import TERMINAL, LiveOperator, make_task

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
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
}
"""Times [s] and memory [MB]; 150 tasks in a second are a time of 1/150 s for each."""

_ONE_BY_ONE = 100
_BURST = 200
_SUSTAINED = 300
_OPEN_AT_ONCE = 20  # unassigned tasks while the sustained rate is measured
_WARM = 10
_START = 1800.0  # time for all nodes of a large hive to find each other [s, wall clock]
_PATIENCE = 60.0
_WHOLE_LIST = 300.0  # time for all tasks on a large hive's list to be assigned or cancelled [s]
_REPEAT = 5.0
_SIDE = 60.0  # side of the square with the goals, unless the row of robots is longer [m]


class Desk:
    """Posts tasks at random places of a square, and records when each is assigned.

    Create it after `rospy.init_node`. The namespace ends in a slash; `side` is the square's [m].

    ROS Publishers: `new_task`, `task_cancel`.
    ROS Subscribers: `task_state`.
    """

    def __init__(self, namespace: str, side: float) -> None:
        self._changed = threading.Condition()
        self._assigned: dict[str, float] = {}
        self._ended: set[str] = set()
        self._tasks: dict[str, Any] = {}
        self._draw = random.Random(1)
        self._side = side
        self._posted = 0
        self._post = rospy.Publisher(
            f"{namespace}new_task", bb_msgs.TaskMsg, queue_size=1000, tcp_nodelay=True
        )
        self._cancel = rospy.Publisher(f"{namespace}task_cancel", String, queue_size=1000)
        self._ear = rospy.Subscriber(
            f"{namespace}task_state", bb_msgs.TaskState, self._hear, tcp_nodelay=True
        )

    @property
    def is_heard(self) -> bool:
        """Whether the blackboard is connected in both directions."""
        return bool(self._post.get_num_connections() and self._ear.get_num_connections())

    def post(self, count: int = 1) -> list[str]:
        """Post some tasks; return their ids."""
        tasks = [self._make() for _ in range(count)]
        for task in tasks:
            self._tasks[task.id] = task
            self._post.publish(task)
        return [task.id for task in tasks]

    def wait(self, tasks: Iterable[str], patience: float = _PATIENCE) -> float:
        """Wait until all of these are assigned; return when the last one was [s, monotonic].

        Unassigned tasks are posted again now and then: without a leader nobody hears them.
        """
        wanted = set(tasks)
        end = time.monotonic() + patience
        with self._changed:
            while not self._changed.wait_for(lambda: wanted <= self._assigned.keys(), _REPEAT):
                missing = wanted - self._assigned.keys()
                if time.monotonic() > end:
                    raise LiveHiveError(
                        f"{len(missing)} of {len(wanted)} tasks not assigned in {patience:.0f} s"
                    )
                for task in missing:
                    self._post.publish(self._tasks[task])
            return max(self._assigned[task] for task in wanted)

    def clear(self) -> None:
        """Cancel every task, again and again until it has ended."""
        end = time.monotonic() + _WHOLE_LIST
        while left := self._tasks.keys() - self._ended:
            if time.monotonic() > end:
                raise LiveHiveError(f"{len(left)} tasks not cancelled in {_WHOLE_LIST:.0f} s")
            for task in left:
                self._cancel.publish(task)
            with self._changed:
                self._changed.wait_for(lambda: self._tasks.keys() <= self._ended, _REPEAT)
        self._tasks.clear()

    def wait_for_fewer(self, tasks: Sequence[str], than: int) -> None:
        """Wait until fewer than so many of these tasks are unassigned."""
        with self._changed:
            self._changed.wait_for(
                lambda: sum(task not in self._assigned for task in tasks) < than, _PATIENCE
            )

    def _make(self) -> bb_msgs.TaskMsg:
        self._posted += 1
        goal = (self._draw.uniform(0.0, self._side), self._draw.uniform(0.0, self._side))
        return make_task(f"A{self._posted}", goal)

    def _hear(self, update: Any) -> None:  # noqa: ANN401  (a TaskState)
        now = time.monotonic()
        # A task posted again is answered with its current state.
        with self._changed:
            if update.state in {bb_msgs.TaskState.ASSIGNED, bb_msgs.TaskState.STARTED}:
                self._assigned.setdefault(update.task_id, now)
            elif update.state in TERMINAL:
                self._ended.add(update.task_id)
            self._changed.notify_all()


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


def measure(robots: int, folder: Path) -> dict[str, float]:
    """Return times [s] and memory [MB] with a number of robots, bare rospy nodes first.

    The folder is for journals and logs.
    """
    side = max(_SIDE, bidders.SPACING * robots)
    with _bare_nodes(robots):
        desk = Desk("/bare/", side)
        _wait_until(lambda: desk.is_heard, f"{robots} bare nodes answer")
        _warm_up(desk)
        figures = spread("bare", one_by_one(desk))
        figures["bare_seconds_per_task"] = sustained(desk)
    with _hive_at(robots, folder) as hive:
        desk = Desk(hive.namespace, side)
        _wait_until(lambda: desk.is_heard, "the hive is connected to the desk")
        _warm_up(desk)
        desk.clear()
        figures[f"burst_of_{_BURST}"] = burst(desk)
        desk.clear()
        figures |= spread("assigned", one_by_one(desk))
        figures["seconds_per_task"] = sustained(desk)
        sizes = [_proportional_size(hive.pid_of(hive.node_of(name))) for name in hive.robots]
    figures |= {"memory_median": statistics.median(sizes), "memory_worst": max(sizes)}
    return figures


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


@contextlib.contextmanager
def _hive_at(robots: int, folder: Path) -> Iterator[LiveHive]:
    """Run a hive in a namespace of its own, once all of it answers and has settled.

    Nobody else listens to it then, as with the bare nodes.
    """
    names = [f"robot{i + 1}" for i in range(robots)]
    hive = LiveHive(folder / f"{robots}", f"/hive{robots}/", names)
    spaces = [f"{hive.namespace}{name}" for name in names]
    with contextlib.ExitStack() as stack:
        stack.callback(hive.end)
        operator = LiveOperator(hive.namespace, hive.members)
        stack.enter_context(_module(bidders, *spaces))
        hive.start_all()
        operator.demand(operator.all_answer, f"{robots} robots answer", _START)
        operator.close()
        # Until then every node asks the ROS master now and then for missing links.
        time.sleep(sum(PAUSES))
        yield hive


def run(robots: int = 0) -> BenchResult:
    """Measure a number of robots, or all `SIZES` if it is 0; see `measure` and `AIMS`."""
    figures: dict[str, float] = {}
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        stack.enter_context(own_master(folder))
        rospy.init_node("bench_auction", anonymous=True, disable_signals=True)
        stack.callback(rospy.signal_shutdown, "what follows ends the master")
        for size in (robots,) if robots else SIZES:
            found = {name: round(value, 5) for name, value in measure(size, folder).items()}
            sys.stderr.write(f"{size} robots: {found}\n")
            figures |= {f"robots_{size}_{name}": value for name, value in found.items()}
    return BenchResult(figures, {k: v for k, v in AIMS.items() if k in figures})
