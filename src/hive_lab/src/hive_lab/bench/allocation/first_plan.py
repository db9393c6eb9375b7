# SPDX-License-Identifier: BSD-3-Clause
"""How long a first plan takes on the wall: a hive whose leader knows no path of the tasks yet.

The hive is that of the other measurements, but its time passes with the wall's, and its search has
a process of its own.
"""

from __future__ import annotations

import queue
import time
from contextlib import closing, suppress
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.cost import measure_for
from blackboard.domain.path_lengths import FieldJob, Moves
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import TASK_STATE
from blackboard.domain.task import TaskState
from blackboard.ros.search_process import SearchProcess
from hive_lab.bench.allocation.instances import KINDS, Places
from hive_lab.bench.allocation.running import tasks_of
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.network import Network

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.auction.search.searcher import Found, Job
    from blackboard.domain.path_lengths import Field, PathLengths
    from blackboard.domain.record import TaskUpdate
    from hive_lab.bench.allocation.instances import Floor

_ROBOTS, _TASKS, _RUNS = 20, 100, 5
_AIM = 0.5  # from the end of gathering until the plan is made [s]
_LIMIT = 60.0  # [s]


class WallHive:
    """A hive of robots that stand, on the wall's time, with a search process of its own.

    Attributes:
        asked: When its search process was asked for something, on the clock of `time.perf_counter`
            [s].
    """

    def __init__(self, places: Places, path_lengths: PathLengths) -> None:
        self._network = Network()
        self._calls: queue.Queue[Callable[[], None]] = queue.Queue()
        self.asked: list[float] = []
        self._searcher = _Searcher(self, self.asked)
        settings = BlackboardSettings(decision="planned", improve_by=measure_for("latency"))
        self.hive = Hive(settings, self._network, path_lengths, self._searcher)
        for number, pose in enumerate(places.robots):
            self.hive.add_robot(f"robot{number + 1}", pose, SMALL_ROBOT, cost_model="latency")
        self._network.run(2.0)

    def call(self, action: Callable[[], None]) -> None:
        """Call an action in the hive's thread."""
        self._calls.put(action)

    def warn(self, text: str) -> None:
        """Fail: a hive that is measured has nothing to warn of."""
        raise RuntimeError(text)

    def run_until(self, condition: Callable[[], bool]) -> None:
        """Let time pass on the wall until a condition holds.

        Raises:
            TimeoutError: It does not hold within a minute.
        """
        began = time.perf_counter()
        ahead = self._network.now - began
        while not condition():
            now = time.perf_counter()
            if now - began > _LIMIT:
                raise TimeoutError(f"no first plan within {_LIMIT:.0f} s")
            self._network.run(max(0.0, now + ahead - self._network.now))
            with suppress(queue.Empty):
                self._calls.get(timeout=0.001)()

    def wait_for_search(self) -> None:
        """Wait until the search process has loaded what it needs."""
        nothing = np.zeros(0)
        moves = Moves(np.zeros(2, np.int32), np.zeros(0, np.int32), nothing, nothing)
        answers: list[Sequence[Field] | None] = []
        self._searcher.fields(FieldJob(moves, [0]), answers.append)
        self.run_until(lambda: bool(answers))
        self.asked.clear()

    def close(self) -> None:
        """End the search process."""
        self._searcher.close()


class _Searcher(SearchProcess):
    """A search process that notes when it is asked."""

    def __init__(self, hive: WallHive, asked: list[float]) -> None:
        super().__init__(hive)  # type: ignore[arg-type]  # of a talker it needs `call` and `warn`
        self._asked = asked

    def search(self, job: Job, done: Callable[[Found | None], None]) -> None:
        self._asked.append(time.perf_counter())
        super().search(job, done)

    def fields(self, job: FieldJob, done: Callable[[Sequence[Field] | None], None]) -> None:
        self._asked.append(time.perf_counter())
        super().fields(job, done)


def first_plan(places: Places, kind: str, path_lengths: PathLengths) -> tuple[float, float]:
    """Return for how long tasks are gathered, and then planned, until one of them is given out.

    Args:
        places: Where robots and tasks are.
        kind: One of `KINDS`.
        path_lengths: Of the leader.

    Returns:
        Both on the wall; the first begins when the last task is posted [s].
    """
    given: list[float] = []

    def note(update: TaskUpdate) -> None:
        if update.state is TaskState.ASSIGNED:
            given.append(time.perf_counter())

    with closing(WallHive(places, path_lengths)) as wall:
        wall.wait_for_search()
        wall.hive.network.listen(TASK_STATE, note)
        wall.hive.post(*tasks_of(places, kind))
        posted = time.perf_counter()
        wall.run_until(lambda: bool(given))
        return wall.asked[0] - posted, given[0] - wall.asked[0]


def measure_first_plan(floor: Floor) -> tuple[dict[str, float], dict[str, float]]:
    """Return figures and aims: medians of some runs, for each kind of task."""
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for kind in KINDS:
        runs = []
        for seed in range(_RUNS):
            places = Places.draw(floor, _ROBOTS, _TASKS, [_ROBOTS, _TASKS, seed])
            runs.append(first_plan(places, kind, floor.own_path_lengths()))
        name = f"first plan {_ROBOTS}x{_TASKS}, {kind}, on the wall"
        gathered, planned = zip(*runs, strict=True)
        figures[f"{name}: gathering [s]"] = median(gathered)
        figures[f"{name}: after it [s]"] = median(planned)
        figures[f"{name}: after it, worst [s]"] = max(planned)
        aims[f"{name}: after it [s]"] = _AIM
    return figures, aims
