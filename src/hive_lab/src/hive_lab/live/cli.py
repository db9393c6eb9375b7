# SPDX-License-Identifier: BSD-3-Clause
"""Measures what a person waits for who types a word of `./hive`.

A blackboard node and four robot nodes run on a ROS master of their own, and the same over Zenoh,
with certificates. Each command runs from the front door on, set-up check included, as a person
would call it.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

from blackboard.errors import LiveHiveError
from hive_common.resources import package_folder
from hive_lab.bench.registry import BenchResult
from hive_lab.live.desk import ZenohWire
from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_hive import ROBOTS, bench_hive
from hive_lab.live.zenoh_hive import ZenohHive

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

RUNS = 9

_TASK = "cli-1"  # what `why` is asked about
_COMMANDS = ("tasks", "robots", "add", "why")
_CONNECTED = ("tasks", "robots", "add")
_ZENOH = "zenoh"  # the namespace of the hive over Zenoh, and what its figures begin with
_START = 60.0  # time in which its robots are heard [s]

AIMS = {
    "setup_check_wall": 0.05,
    **{f"{name}_cpu": 0.4 for name in _COMMANDS},
    **{f"{name}_wall": 0.6 for name in _COMMANDS},
    **{f"{_ZENOH}_{name}_cpu": 0.4 for name in _CONNECTED},
    **{f"{_ZENOH}_{name}_wall": 0.6 for name in _CONNECTED},
}
"""Times of one command [s]."""

_CHECK = "root=$1; source setup/install.bash; is_ready"


def run(runs: int = RUNS) -> BenchResult:
    """Return the median processor and wall time [s] of the set-up check and of each command.

    The figures of commands with --connect begin with `zenoh`.
    """
    root = package_folder("hive_lab").parents[1]
    figures: dict[str, float] = {}
    with bench_hive("bench_cli") as (hive, operator):
        operator.wait_until_whole()
        _spend(root, ["./hive", "add", "GA", "--goal", "1,2", "--id", _TASK])
        figures |= _medians(
            "setup_check", root, itertools.repeat(["bash", "-c", _CHECK, "-", str(root)], runs)
        )
        why = itertools.repeat(["why", _TASK, "--journal", str(hive.journals)], runs)
        for name, words in {**_words(runs), "why": why}.items():
            figures |= _medians(name, root, (["./hive", *each] for each in words))
        with _over_zenoh() as fleet:
            for name, words in _words(runs).items():
                there = ["env", f"ROS_NAMESPACE={_ZENOH}", "./hive", "--connect", fleet]
                commands = ([*there, *each] for each in words)
                figures |= _medians(f"{_ZENOH}_{name}", root, commands)
    return BenchResult(figures, dict(AIMS))


def _words(runs: int) -> dict[str, Iterable[Sequence[str]]]:
    """Return what is typed in each run, by command."""
    return {
        "tasks": itertools.repeat(["tasks"], runs),
        "robots": itertools.repeat(["robots"], runs),
        "add": (["add", "GA", "--goal", f"{i},2"] for i in range(runs)),
    }


@contextlib.contextmanager
def _over_zenoh() -> Iterator[str]:
    """Run such a hive over Zenoh, and return its fleet file once all robots are heard."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robo-hive-bench-")))
        hive = ZenohHive(folder / _ZENOH, f"/{_ZENOH}/", ROBOTS)
        stack.callback(hive.end)
        bases = [FakeBase(f"{hive.namespace}{name}") for name in hive.robots]
        hive.start_all()
        wire = ZenohWire(hive)
        stack.callback(wire.close)
        wire.wait_for_robots(hive.robots, _START)
        yield str(hive.fleet_file)
        bases.clear()


def _medians(name: str, root: Path, commands: Iterable[Sequence[str]]) -> dict[str, float]:
    """Run commands; return the medians of their processor and wall times [s] by name."""
    spent = [_spend(root, command) for command in commands]
    cpu, wall = (statistics.median(each) for each in zip(*spent, strict=True))
    return {f"{name}_cpu": round(cpu, 3), f"{name}_wall": round(wall, 3)}


def _spend(root: Path, command: Sequence[str]) -> tuple[float, float]:
    """Run a command in the clone; return processor time, with its children, and wall time [s]."""
    since = time.monotonic()
    nowhere = subprocess.DEVNULL
    process = subprocess.Popen(command, cwd=root, stdout=nowhere, stderr=nowhere)  # noqa: S603  (ours)
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.monotonic() - since
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise LiveHiveError(f"{' '.join(command)} ended with {process.returncode}")
    return usage.ru_utime + usage.ru_stime, wall
