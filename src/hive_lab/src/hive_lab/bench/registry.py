# SPDX-License-Identifier: BSD-3-Clause
"""The benchmarks by name, and the form of their results."""

from __future__ import annotations

import contextlib
import multiprocessing
import tempfile
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from blackboard.errors import LiveHiveError
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.errors import TimeUpError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fleet_manager.cli.context import CliContext

Value = TypeVar("Value")


def run_apart(function: Callable[..., Value], *arguments: object) -> Value:
    """Call a function of a module in a process of its own, and return what it returns.

    rospy connects a process to one ROS master only, and to that only once.

    Raises:
        Exception: What the function raises.
    """
    with multiprocessing.get_context("fork").Pool(1) as pool:
        return pool.apply(function, arguments)


@dataclass(frozen=True)
class BenchResult:
    """The result of a benchmark.

    Attributes:
        figures: Every figure by name; the benchmark's description has the unit.
        aims: Upper limits of some figures, by the same names.
        broken: Whether the system broke a promise.
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
    """One benchmark: a module of `hive_lab` with a function `run` that returns a `BenchResult`.

    Attributes:
        line: What it measures, in a line, with units.
        module: Imported only when it runs.
        options: What a user may choose, as arguments of `run`: `runs`, `minutes` and so on.
        connects: Whether `run` gets a function that opens a link to a hive.
        own_master: Whether it needs a ROS master of its own.
    """

    line: str
    module: str
    options: tuple[str, ...] = ()
    connects: bool = False
    own_master: bool = False

    def run(self, context: CliContext, chosen: Mapping[str, object] | None = None) -> BenchResult:
        """Measure, with what the user chose of `options`."""
        arguments: list[Any] = [context.connect] if self.connects else []
        with contextlib.ExitStack() as stack:
            if self.own_master:
                folder = tempfile.TemporaryDirectory(prefix="robo-hive-bench-")
                stack.enter_context(local_hive(Path(stack.enter_context(folder))))
            try:
                run = import_module(f"hive_lab.{self.module}").run
                result: BenchResult = run(*arguments, **(chosen or {}))
            except LiveHiveError as error:
                raise TimeUpError(f"the hive was too slow to be measured: {error}") from error
        return result


BENCHES: Mapping[str, Bench] = {
    "allocation": Bench(
        "plans over the best known ones, and times to done [s] of tasks that arrive over time",
        "bench.allocation.measure",
    ),
    "architectures": Bench(
        "the hive, a central dispatcher and a market: times to done [s], energy, messages, CPU",
        "bench.architectures.measure",
        options=("robots", "runs", "resume"),
    ),
    "auction": Bench(
        "from posting to ASSIGNED [s] with 4 and 10 robots or --robots, memory [MB], over ROS and "
        "Zenoh",
        "live.auction",
        options=("robots", "transport"),
        own_master=True,
    ),
    "charge": Bench(
        "relative error of the predicted charge of 100 tasks in the simulator, without its sign",
        "bench.charge",
    ),
    "cli": Bench(
        "processor and wall time [s] of commands, on ROS and over Zenoh, and of the set-up check",
        "live.cli",
        options=("runs",),
        own_master=True,
    ),
    "day": Bench(
        "24 simulated hours with a task every two minutes: tasks not done, robots stranded [1]",
        "bench.day",
    ),
    "decision": Bench(
        "bytes and processor time [s] per task, with bids computed by robots or the blackboard",
        "live.decision",
    ),
    "faults": Bench(
        "simulated schedules of faults [1/s], and the properties they break; --schedules N",
        "bench.faults",
        options=("schedules", "mutations", "resume", "transport"),
    ),
    "failover": Bench(
        "time [s] without a leader after a crash and after a freeze, on real ROS",
        "live.failover",
        options=("runs",),
        own_master=True,
    ),
    "flake": Bench(
        "passes, failures and times [s] of each case of the test plan in 20 runs, or in --runs",
        "bench.flake",
        options=("runs",),
    ),
    "fuzz": Bench(
        "odd messages that hives at work cannot stand [1], virtual time; --messages N, --seed S",
        "fuzz.bench",
        options=("messages", "seed"),
    ),
    "fuzz-ros": Bench(
        "odd messages that a hive of real nodes cannot stand [1]; --messages N, --seed S",
        "live.odd_messages",
        options=("messages", "seed"),
        own_master=True,
    ),
    "gui": Bench(
        "longest stall [s] of the windows' event loop in each case, start [s], CPU, memory [MB]",
        "windows.bench",
    ),
    "hive": Bench(
        "a simulated hive of 10 to 1000 robots, or of --robots: time [s], messages, memory [MB]",
        "bench.hive",
        options=("robots",),
    ),
    "large-map": Bench(
        "time [s] and memory [GB] of navigation, traffic and bids with a map of 4,000 x 4,000",
        "bench.large_map",
    ),
    "learning": Bench(
        "errors of predicted time and energy of tasks, by formula and learned [1], virtual time",
        "bench.learning",
        options=("runs",),
    ),
    "localization": Bench(
        "the particle filter's errors [m, degrees], lost robots not found [0..1], CPU [s per s]",
        "bench.localization",
    ),
    "mapping": Bench(
        "wrong cells [0..1] and walls' errors [m] of a map of the lab that a robot made alone",
        "bench.mapping",
    ),
    "navigation": Bench(
        "a control tick [ms], wall time for a simulated second [s], 50 and 200 robots in a hall",
        "bench.navigation",
    ),
    "plan": Bench(
        "planning time [s] and length of the path over the shortest one, 200 pairs on each map",
        "bench.plan",
    ),
    "scale": Bench(
        "messages, bytes and processor time [s] per task, 10 to 1000 robots, and how they grow",
        "bench.scale.measure",
        options=("robots", "resume"),
    ),
    "sim": Bench(
        "wall time for a simulated second [s] and the reverse, 1 to 100 robots, and through ROS",
        "live.simulator",
        connects=True,
    ),
    "soak": Bench(
        "tasks not done [1] and growth [MB, threads, files] of a hive with a fault each minute",
        "live.soak",
        options=("minutes", "resume"),
        own_master=True,
    ),
    "start": Bench(
        "from roslaunch to the first accepted task of 4 robots, and until 50 robots are up [s]",
        "bench.start",
        connects=True,
    ),
    "system": Bench(
        "CPU [s per s] and memory [GB] of 4 robots, or --robots, that all drive, without RViz",
        "bench.system",
        options=("robots",),
        connects=True,
    ),
    "traffic": Bench(
        "share of its throughput that a fleet loses [1]; --map: MAPF files; --faults N; --ros",
        "bench.traffic.measure",
        options=(
            "map",
            "scen",
            "faults",
            "site",
            "robots",
            "minutes",
            "runs",
            "local",
            "people",
            "close",
            "delays",
            "ros",
            "adversarial",
            "resume",
        ),
        connects=True,
    ),
    "vda5050": Bench(
        "CPU [s per s] of 20 AGVs' agents, of the AGVs and their broker; time of an order [s]",
        "bench.vda5050",
        options=("robots", "minutes"),
    ),
}


def as_json(name: str, result: BenchResult, machine: str, date: str) -> dict[str, Any]:
    """Return the JSON form of a result that was measured on a machine at a date, ISO 8601."""
    return {
        "bench": name,
        "machine": machine,
        "date": date,
        "figures": dict(result.figures),
        "aims": dict(result.aims),
        "met": result.met,
    }
