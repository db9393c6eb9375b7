# SPDX-License-Identifier: BSD-3-Clause
"""Measures what a person waits for who types a word of `./hive`.

A blackboard node and four robot nodes run on a ROS master of their own. Each command runs from the
front door on, set-up check included, as a person would call it.
"""

from __future__ import annotations

import itertools
import os
import statistics
import subprocess
import time
from typing import TYPE_CHECKING

from blackboard.errors import LiveHiveError
from hive_common.resources import package_folder
from hive_lab.bench.registry import BenchResult
from hive_lab.live.live_hive import bench_hive

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

RUNS = 9

_TASK = "cli-1"  # what `why` is asked about
_COMMANDS = ("tasks", "robots", "add", "why")

AIMS = {
    "setup_check_wall": 0.05,
    **{f"{name}_cpu": 0.4 for name in _COMMANDS},
    **{f"{name}_wall": 0.6 for name in _COMMANDS},
}
"""Times of one command [s]."""

_CHECK = "root=$1; source setup/install.bash; is_ready"


def run(runs: int = RUNS) -> BenchResult:
    """Return the median processor and wall time [s] of the set-up check and of each command."""
    root = package_folder("hive_lab").parents[1]
    figures: dict[str, float] = {}
    with bench_hive("bench_cli") as (hive, operator):
        operator.wait_until_whole()
        _spend(root, ["./hive", "add", "GA", "--goal", "1,2", "--id", _TASK])
        figures |= _medians(
            "setup_check", root, itertools.repeat(["bash", "-c", _CHECK, "-", str(root)], runs)
        )
        words = {
            "tasks": itertools.repeat(["tasks"], runs),
            "robots": itertools.repeat(["robots"], runs),
            "add": (["add", "GA", "--goal", f"{i},2"] for i in range(runs)),
            "why": itertools.repeat(["why", _TASK, "--journal", str(hive.journals)], runs),
        }
        for name in _COMMANDS:
            figures |= _medians(name, root, (["./hive", *each] for each in words[name]))
    return BenchResult(figures, dict(AIMS))


def _medians(name: str, root: Path, commands: Iterator[Sequence[str]]) -> dict[str, float]:
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
