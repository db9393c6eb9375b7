# SPDX-License-Identifier: BSD-3-Clause
"""Runs the test plan repeatedly, to find cases that do not always pass."""

from __future__ import annotations

import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ET
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

import click

from fleet_manager.errors import InputError
from hive_common.resources import package_folder
from hive_lab.bench.registry import BenchResult

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

AIMS = {"failures": 0.0, "a run longest": 480.0}


@dataclass(frozen=True)
class CaseRun:
    """One run of a case named `FILE: TEST`, which took a time on the wall clock [s]."""

    name: str
    passed: bool
    time: float


@dataclass(frozen=True)
class PlanRun:
    """One run of the whole plan; `time` includes start and end of the system [s, wall clock]."""

    cases: tuple[CaseRun, ...]
    time: float


def run(runs: int = 20) -> BenchResult:
    """Run the test plan several times, and print a line for each run.

    The output of a failed run is kept in a temporary folder, which its line names.

    Returns:
        `runs`, `failures` (runs with a failed or missing case), median and longest time of a run
        [s], and for each case `passes`, `failures`, and its median and longest time [s].
    """
    root = package_folder("fleet_manager").parents[1]
    files = sorted((root / "test" / "rostest").glob("plan_*.test"))
    if not files:
        raise InputError(f"no test plan in {root}; run this from a clone of the repository")
    results = []
    for number in range(1, runs + 1):
        begun = time.monotonic()
        with tempfile.TemporaryDirectory(prefix="robo-hive-flake-") as folder:
            cases = tuple(_run_once(root, files, Path(folder)))
            word = f"{len(cases)} cases passed"
            if failed := [case.name for case in cases if not case.passed]:
                kept = shutil.copytree(folder, f"{folder}-failed")
                word = f"failed: {', '.join(failed)}, see {kept}"
        results.append(PlanRun(cases, time.monotonic() - begun))
        click.echo(f"run {number} of {runs}: {word}, {results[-1].time:.0f} s", err=True)
    return BenchResult(figures(results), AIMS)


def _run_once(root: Path, files: Iterable[Path], folder: Path) -> Iterator[CaseRun]:
    pytest = [sys.executable, "-m", "pytest", "-c", str(root / "pyproject.toml")]
    options = ["-q", "-o", "pythonpath=", "-p", "no:cacheprovider", "--results", str(folder)]
    with (folder / "pytest.log").open("w") as log:
        _run_to_its_end([*pytest, *options, *map(str, files)], log)
    for file in files:
        result = folder / f"{file.stem}.xml"
        yield from cases_of(result) if result.exists() else [CaseRun(file.stem, False, 0.0)]


def _run_to_its_end(command: Sequence[str], log: IO[str]) -> None:
    """Run tests; on Ctrl-C, let them stop everything they have started first."""
    tests = subprocess.Popen(  # noqa: S603  (our own tests)
        command,
        env={k: v for k, v in os.environ.items() if k != "ROS_MASTER_URI"},
        stdout=log,
        start_new_session=True,
    )
    try:
        tests.wait()
    except KeyboardInterrupt:
        tests.send_signal(signal.SIGINT)
        tests.wait()
        raise


def cases_of(file: Path) -> list[CaseRun]:
    """Return the cases of a JUnit file that pytest has written."""
    return [
        CaseRun(
            name=f"{file.stem}: {case.get('name')}",
            passed=case.find("failure") is None and case.find("error") is None,
            time=float(case.get("time", "0")),
        )
        for case in ET.parse(file).iter("testcase")  # noqa: S314  (our own results)
    ]


def figures(results: Sequence[PlanRun]) -> dict[str, float]:
    """Return the figures of at least one run, by name."""
    by_case: defaultdict[str, list[CaseRun]] = defaultdict(list)
    for case in (case for result in results for case in result.cases):
        by_case[case.name].append(case)
    found: dict[str, float] = {
        "runs": len(results),
        "failures": sum(not all(case.passed for case in result.cases) for result in results),
        **_times("a run", [result.time for result in results]),
    }
    for name, cases in by_case.items():
        found[f"{name} passes"] = sum(case.passed for case in cases)
        found[f"{name} failures"] = sum(not case.passed for case in cases)
        found |= _times(name, [case.time for case in cases])
    return found


def _times(name: str, times: Sequence[float]) -> dict[str, float]:
    return {f"{name} median": statistics.median(times), f"{name} longest": max(times)}
