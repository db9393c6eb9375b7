# SPDX-License-Identifier: BSD-3-Clause
"""The benchmarks by name, and the form in which every one of them gives its figures."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from blackboard.errors import LiveHiveError
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.errors import TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fleet_manager.cli.outside import Outside


@dataclass(frozen=True)
class BenchResult:
    """What a benchmark found.

    Attributes:
        figures: Every figure by name; the unit is in the benchmark's description.
        aims: What some of the figures should be at most, by the same names.
        broken: Whether it has found that the system breaks a promise.
    """

    figures: Mapping[str, float]
    aims: Mapping[str, float]
    broken: bool = False

    @property
    def met(self) -> dict[str, bool]:
        """Whether each aim is met."""
        return {name: self.figures[name] <= aim for name, aim in self.aims.items()}


@dataclass(frozen=True)
class Bench:
    """One benchmark.

    Attributes:
        line: What it measures, in a line, with units.
        run: Measures.
        repeat: Measures with a count that the user chooses; None where there is no such choice.
        counts: What is counted then, and the name of the option: `runs`, `schedules`, `minutes`,
            `robots`.
    """

    line: str
    run: Callable[[Outside], BenchResult]
    repeat: Callable[[int], BenchResult] | None = None
    counts: str = ""


def _on_live_hive(module: str, *count: int) -> BenchResult:
    """Run a benchmark of `hive_lab.live` on a ROS master of its own.

    Raises:
        TimeUpError: The hive did not do in time what the benchmark waits for.
    """
    with (
        tempfile.TemporaryDirectory(prefix="robo-hive-bench-") as folder,
        local_hive(Path(folder)),
    ):
        try:
            found: dict[str, dict[str, float]] = import_module(f"hive_lab.live.{module}").run(
                *count
            )
        except LiveHiveError as error:
            raise TimeUpError(f"the hive was too slow to be measured: {error}") from error
    return BenchResult(found["figures"], found["aims"])


_failover = partial(_on_live_hive, "failover")
_soak = partial(_on_live_hive, "soak")
_auction = partial(_on_live_hive, "auction")


def _system(outside: Outside) -> BenchResult:
    result: BenchResult = import_module("hive_lab.bench.system").measure(outside.connect)
    return result


def _plan(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("hive_lab.bench.plan").run()
    return BenchResult(found["figures"], found["aims"])


def _localization(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("hive_lab.bench.localization").run()
    return BenchResult(found["figures"], found["aims"])


def _sim(outside: Outside) -> BenchResult:
    result: BenchResult = import_module("hive_lab.bench.simulator").measure(outside.connect)
    return result


def _charge(_outside: Outside) -> BenchResult:
    result: BenchResult = import_module("hive_lab.bench.charge").measure()
    return result


_DAY = Path("day.png")


def _day(_outside: Outside) -> BenchResult:
    result: BenchResult = import_module("hive_lab.bench.day").measure(picture=_DAY)
    click.echo(f"drawn in {_DAY}", err=True)
    return result


def _mapping(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("hive_lab.bench.mapping").run()
    return BenchResult(found["figures"], found["aims"])


def _gui(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("hive_lab.windows.bench").run()
    return BenchResult(found["figures"], found["aims"])


def _allocation(_outside: Outside) -> BenchResult:
    result: BenchResult = import_module("hive_lab.bench.allocation.measure").measure()
    return result


def _decision(_outside: Outside) -> BenchResult:
    result: BenchResult = import_module("hive_lab.live.decision").measure()
    return result


_SCHEDULES = 1000


def _faults(schedules: int = _SCHEDULES) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("hive_lab.bench.faults").run(
        schedules, say=partial(click.echo, err=True)
    )
    return BenchResult(found["figures"], found["aims"], found["figures"]["violations"] > 0)


def _exchange(_outside: Outside) -> BenchResult:
    found: dict[str, dict[str, float]] = import_module("hive_lab.bench.exchange").run()
    return BenchResult(found["figures"], found["aims"])


def _hive(*sizes: int) -> BenchResult:
    chosen = {"sizes": sizes} if sizes else {}
    found: dict[str, dict[str, float]] = import_module("hive_lab.bench.hive").run(
        **chosen, say=partial(click.echo, err=True)
    )
    broken = any(value for name, value in found["figures"].items() if name.endswith("_broken"))
    return BenchResult(found["figures"], found["aims"], broken)


def _flake(runs: int) -> BenchResult:
    result: BenchResult = import_module("hive_lab.bench.flake").run(runs)
    return result


BENCHES: Mapping[str, Bench] = {
    "allocation": Bench(
        "plans over the best known ones, and times to done [s] of tasks that arrive over time",
        _allocation,
    ),
    "auction": Bench(
        "from posting to ASSIGNED [s], with 4 and 10 robots or --robots, memory [MB], on ROS",
        lambda _outside: _auction(),
        _auction,
        "robots",
    ),
    "charge": Bench(
        "predicted over used charge of 100 tasks in the simulator, less 1, without its sign",
        _charge,
    ),
    "day": Bench(
        "24 simulated hours with a task every two minutes: tasks not done, robots stranded [1]",
        _day,
    ),
    "decision": Bench(
        "bytes and processor time [s] for each task, bids worked out by robots or the blackboard",
        _decision,
    ),
    "exchange": Bench(
        "what exchanging tasks makes small over what it was before, and tasks given anew [1]",
        _exchange,
    ),
    "faults": Bench(
        "simulated schedules of faults [1/s], and the properties they break; --schedules N",
        lambda _outside: _faults(),
        _faults,
        "schedules",
    ),
    "failover": Bench(
        "time [s] without an active blackboard after a crash and after a freeze, on real ROS",
        lambda _outside: _failover(),
        _failover,
        "runs",
    ),
    "flake": Bench(
        "passes, failures and times [s] of each case of the test plan in 20 runs, or in --runs",
        lambda _outside: _flake(20),
        _flake,
        "runs",
    ),
    "gui": Bench(
        "longest stall [s] of the windows' event loop in each case, start [s], CPU, memory [MB]",
        _gui,
    ),
    "hive": Bench(
        "a simulated hive of 10 to 1000 robots, or of --robots: time [s], messages, memory [MB]",
        lambda _outside: _hive(),
        _hive,
        "robots",
    ),
    "localization": Bench(
        "the particle filter's errors [m, degrees], lost robots not found [0..1], CPU [s per s]",
        _localization,
    ),
    "mapping": Bench(
        "wrong cells [0..1] and walls' errors [m] of a map of the lab that a robot made alone",
        _mapping,
    ),
    "plan": Bench(
        "planning time [s] and length of the way over the shortest one, 200 pairs on each map",
        _plan,
    ),
    "sim": Bench(
        "wall time for a simulated second [s] and the reverse, 1 to 100 robots, and through ROS",
        _sim,
    ),
    "soak": Bench(
        "tasks not done [1] and growth [MB, threads, files] of a hive that is broken each minute",
        lambda _outside: _soak(),
        _soak,
        "minutes",
    ),
    "system": Bench(
        "CPU [s per s] and memory [GB] of four robots that all drive, without RViz, in real time",
        _system,
    ),
}
"""Imported only when run, because they need what `hive bench` alone does not."""


def as_json(name: str, result: BenchResult, machine: str, date: str) -> dict[str, Any]:
    """Return a result in the form in which it is kept in files.

    Args:
        name: Of the benchmark.
        result: What it found.
        machine: On which machine, in words.
        date: When, ISO 8601.
    """
    return {
        "bench": name,
        "machine": machine,
        "date": date,
        "figures": dict(result.figures),
        "aims": dict(result.aims),
        "met": result.met,
    }
