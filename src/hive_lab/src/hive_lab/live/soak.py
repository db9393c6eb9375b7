# SPDX-License-Identifier: BSD-3-Clause
"""Runs a hive on real ROS for a long time, with a fault every minute.

Tasks keep coming. Every minute a random member is killed or frozen. In the end every task has to
be done, and no process may have grown.
"""

from __future__ import annotations

import itertools
import random
import sys
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import psutil
from blackboard.msg import TaskState

from blackboard.auction.decision_log import ENDING
from blackboard.domain.settings import BlackboardSettings
from hive_lab.bench.kept_runs import KeptRuns
from hive_lab.bench.registry import BenchResult
from hive_lab.live.live_hive import bench_hive
from hive_lab.live.live_operator import TERMINAL, make_task

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from hive_lab.live.live_hive import LiveHive
    from hive_lab.live.live_operator import LiveOperator

MINUTES = 60  # default duration [min]

AIMS = {
    "tasks_not_done": 0.0,
    "memory_growth": 5.0,
    "thread_growth": 3.0,
    "file_growth": 10.0,
    "journal_growth": 5.0,
}
"""Largest growth of a process after its first minute [MB, threads, open files], and of a member's
journal after that [MB].

The task list keeps `most_ended` ended tasks. While it fills, each process and journal grows, so a
run that fills it measures from there on; a shorter run includes that growth. The ROS master keeps
up to three connections to a node that it has told of others, and the node has a thread for each.
"""

_SUMS = ("minutes", "minutes_at_full_list", "faults", "takeovers", "tasks", "tasks_not_done")
"""What adds up over pieces; of the growths, the largest counts."""

_FAULT_EVERY = 60.0
_CALM = 50.0
"""For up to 32 s after a fault, rospy keeps threads that try to reach the lost node [s]."""
_TASK_EVERY = 2.0
_FREEZE = 5.0
_WARM = 60.0  # age after which a process should not grow [s]
_MOST_ENDED = BlackboardSettings().most_ended


@dataclass(frozen=True)
class Size:
    """A process's resident memory [MB], threads, and open files and connections."""

    memory: float
    threads: float
    files: float

    @classmethod
    def of(cls, pid: int) -> Size:
        """Measure a process."""
        process = psutil.Process(pid)
        memory = process.memory_info().rss / 1e6
        return cls(memory, float(process.num_threads()), float(process.num_fds()))

    def __sub__(self, other: Size) -> Size:
        return Size(
            self.memory - other.memory, self.threads - other.threads, self.files - other.files
        )


class Growth:
    """Tracks how much each process grows after its first minute, or the first one seen here.

    Args:
        clock: Returns the time [s].
        size_of: Measures the process of an id.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        size_of: Callable[[int], Size] = Size.of,
    ) -> None:
        self._clock = clock
        self._size_of = size_of
        self._born: dict[int, float] = {}
        self._grown_up: dict[int, Size] = {}
        self.worst = Size(0.0, 0.0, 0.0)
        self.of_journals = 0
        self._journals: dict[Path, int] = {}

    def look(self, pids: Iterable[int]) -> None:
        """Measure these processes."""
        now = self._clock()
        for pid in pids:
            if now - self._born.setdefault(pid, now) < _WARM:
                continue
            size = self._size_of(pid)
            growth = size - self._grown_up.setdefault(pid, size)
            self.worst = Size(
                max(self.worst.memory, growth.memory),
                max(self.worst.threads, growth.threads),
                max(self.worst.files, growth.files),
            )

    def look_at_journals(self, folder: Path) -> None:
        """Measure the files of all journals, but for what SQLite writes beside them.

        Decision logs do not count; each grows to the size that `decision_log` allows.
        """
        for file in folder.glob("*.sqlite3"):
            if file.name.endswith(ENDING):
                continue
            size = file.stat().st_size
            self.of_journals = max(self.of_journals, size - self._journals.setdefault(file, size))


class Posted:
    """Follows tasks to their ends while the hive goes on, which forgets them after an hour.

    Args:
        state_of: Returns the state of a task on the hive's list; -1 if it is not there.

    Attributes:
        total: How many were posted.
        ended: How many of them have ended.
        done: How many of them are DONE.
    """

    def __init__(self, state_of: Callable[[str], int]) -> None:
        self._state_of = state_of
        self._open: set[str] = set()
        self.total = self.ended = self.done = 0

    def add(self, task_id: str) -> None:
        """Follow a task that was just posted."""
        self._open.add(task_id)
        self.total += 1

    def have_ended(self) -> bool:
        """Look at all whose end is not known yet; return whether there are none left."""
        for task_id in tuple(self._open):
            state = self._state_of(task_id)
            if state in TERMINAL:
                self._open.discard(task_id)
                self.ended += 1
                self.done += state == TaskState.DONE
        return not self._open


def _faults(hive: LiveHive, draw: random.Random) -> Iterator[str]:
    """Inject one fault after another, and yield what it was."""
    while True:
        node = draw.choice(hive.members)
        kind = draw.choice(("kill", "freeze"))
        if kind == "kill":
            hive.kill(node)
            hive.start(node)
        else:
            hive.freeze(node)
            time.sleep(_FREEZE)
            hive.thaw(node)
        yield f"{kind} {node}"


def _work(hive: LiveHive, operator: LiveOperator, minutes: float, seed: int) -> dict[str, float]:
    draw = random.Random(seed + 1)
    faults, growth, names = _faults(hive, draw), Growth(), itertools.count()
    begun = time.monotonic()
    next_fault, posted = begun + _FAULT_EVERY, Posted(operator.state_of)
    injected = 0
    full_since: float | None = None
    while time.monotonic() - begun < 60.0 * minutes:
        name = f"soak{next(names)}"
        posted.add(name)
        operator.post(make_task(name, (draw.uniform(-9.0, 9.0), draw.uniform(-9.0, 9.0))))
        if time.monotonic() > next_fault:
            next_fault += _FAULT_EVERY
            injected += 1
            sys.stderr.write(f"{time.monotonic() - begun:6.0f} s  {next(faults)}\n")
        if next_fault - time.monotonic() < _FAULT_EVERY - _CALM:
            growth.look(hive.pids())
            growth.look_at_journals(hive.journals)
        time.sleep(_TASK_EVERY)
        posted.have_ended()
        if full_since is None and posted.ended >= _MOST_ENDED:
            full_since, growth = time.monotonic(), Growth()
    at_full_list = 0.0 if full_since is None else time.monotonic() - full_since
    operator.wait(posted.have_ended)
    epochs = {beat.epoch for _, beat in operator.beats}
    return {
        "minutes": minutes,
        "minutes_at_full_list": round(at_full_list / 60.0, 1),
        "faults": float(injected),
        "takeovers": float(len(epochs) - 1),
        "tasks": float(posted.total),
        "tasks_not_done": float(posted.total - posted.done),
        "memory_growth": round(growth.worst.memory, 1),
        "thread_growth": growth.worst.threads,
        "file_growth": growth.worst.files,
        "journal_growth": round(growth.of_journals / 1e6, 1),
    }


def run(minutes: int = MINUTES, resume: Path | None = None) -> BenchResult:
    """Measure for some minutes; see `AIMS`.

    Args:
        minutes: How long, at least 2 [min].
        resume: Where the figures of earlier pieces are; this one is added, and the sum returned.

    Raises:
        hive_common.errors.FileError: `resume` holds something else.
    """
    kept = KeptRuns(resume)
    with bench_hive("bench_soak") as (hive, operator):
        operator.wait_until_whole()
        figures = _work(hive, operator, minutes, len(kept.names))
    kept.keep(f"piece {len(kept.names) + 1}", figures)
    return BenchResult(added_up([kept[name] for name in kept.names]), dict(AIMS))


def added_up(pieces: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Return the figures of several pieces in one."""
    return {
        name: (sum if name in _SUMS else max)(piece[name] for piece in pieces)
        for name in pieces[0]
    }
