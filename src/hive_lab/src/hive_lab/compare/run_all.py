# SPDX-License-Identifier: BSD-3-Clause
"""Runs all runs of an experiment one after the other, each in a process of its own."""

from __future__ import annotations

import multiprocessing
import signal
import sys
import time
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from fleet_manager.config.places import places_of
from fleet_manager.demo.picture import draw_run
from fleet_manager.errors import FleetManagerError, StartError
from hive_common.errors import HiveError
from hive_common.map_file import load_map
from hive_lab.compare.forecast import Forecast, share_of_run
from hive_lab.compare.results import Results, machine_words
from hive_lab.compare.simulator_run import run_in_simulator
from hive_lab.compare.sources import sources_of
from hive_lab.compare.virtual_run import run_virtual

if TYPE_CHECKING:
    from collections.abc import Callable
    from multiprocessing.connection import Connection
    from pathlib import Path

    from hive_lab.compare.experiment import Experiment, Variant

TELL_EVERY = 0.5  # least time between two words on the progress of a run [s]
_END_WITHIN = 30.0  # time that a run has to end its processes [s]


@dataclass(frozen=True)
class Progress:
    """How far an experiment is.

    Attributes:
        run: The run under way, in words.
        number: Its number, from 1.
        runs: How many there are.
        share: Of all of them that is done, 0..1.
        remaining: Estimated time until the end [s]; None while too little is known.
    """

    run: str
    number: int
    runs: int
    share: float
    remaining: float | None


def run_all(
    experiment: Experiment, folder: Path, tell: Callable[[Progress], None], machine: str = ""
) -> Results:
    """Run an experiment; the pictures and logs of the runs go into a folder.

    Args:
        experiment: What runs.
        folder: An empty folder.
        tell: Called about twice a second.
        machine: In words; by default this one.

    Raises:
        HiveError: A run could not be made; the text names it.
    """
    date = datetime.now().astimezone().isoformat(timespec="seconds")
    runs, sources = experiment.runs, sources_of(experiment)
    reports: dict[str, list[dict[str, Any]]] = {
        variant.label: [] for variant in experiment.variants
    }
    pictures: dict[str, Path] = {}
    forecast = Forecast([variant for variant, _ in runs])
    for number, (variant, seed) in enumerate(runs):
        words, began = f"{variant.label}, seed {seed}", time.monotonic()

        def told(
            share: float, done: int = number, words: str = words, began: float = began
        ) -> None:
            left = forecast.remaining(time.monotonic() - began, share)
            tell(Progress(words, done + 1, len(runs), (done + share) / len(runs), left))

        told(0.0)
        picture = folder / f"{variant.file_name}-{seed}.png"
        reports[variant.label].append(_apart(experiment, variant, seed, picture, told))
        pictures[words] = picture
        forecast.note(time.monotonic() - began)
    return Results(
        experiment.name,
        date,
        machine or machine_words(),
        reports,
        pictures,
        sources,
        experiment.description,
    )


def _apart(
    experiment: Experiment,
    variant: Variant,
    seed: int,
    picture: Path,
    tell: Callable[[float], None],
) -> dict[str, Any]:
    """Make one run in a process of its own: rospy connects a process to one hive only.

    It is forked: catkin's packages of a source tree put that tree first on the path, where a new
    interpreter would look for messages in vain.
    """
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)
    worker = context.Process(target=_work, args=(theirs, experiment, variant, seed, picture))
    worker.start()
    theirs.close()
    run = f"{variant.label}, seed {seed}"
    try:
        report = _listen(ours, tell, run)
    except BaseException:  # Ctrl-C too: the run has to end its processes
        worker.terminate()
        raise
    finally:
        worker.join(_END_WITHIN)
        if worker.is_alive():
            worker.kill()
            worker.join()
    return report


def _listen(pipe: Connection, tell: Callable[[float], None], run: str) -> dict[str, Any]:
    """Tell the progress of a run until its report comes.

    Raises:
        StartError: It failed.
    """
    try:
        while True:
            kind, value = pipe.recv()
            if kind == "report":
                report: dict[str, Any] = value
                return report
            if kind == "failed":
                raise StartError(f"{run}: {value}")
            tell(value)
    except EOFError:
        raise StartError(
            f"{run}: its process ended unexpectedly; what it wrote is above"
        ) from None


def _work(
    pipe: Connection, experiment: Experiment, variant: Variant, seed: int, picture: Path
) -> None:
    """Make one run, tell its progress, and send its report."""
    _end_by_exit()
    last = [0.0]
    scenario = experiment.scenario_of(seed)

    def look(now: float, ended: float) -> None:
        if time.monotonic() - last[0] >= TELL_EVERY:
            last[0] = time.monotonic()
            pipe.send(("share", share_of_run(scenario, now, ended)))

    try:
        if experiment.run_on == "virtual":
            result = run_virtual(experiment, variant, seed, look)
        else:
            folder = picture.with_suffix("")
            folder.mkdir()
            result = run_in_simulator(experiment, variant, seed, look, folder)
    except (HiveError, FleetManagerError) as error:
        pipe.send(("failed", str(error)))
        return
    report = {
        **result.report,
        "architecture": variant.architecture,
        "decision": variant.decision,
        "seed": seed,
        "remarks": result.remarks,
        "run_on": experiment.run_on,
    }
    places = places_of(scenario.world)
    draw_run(picture, report, result.history, load_map(scenario.map), places)
    pipe.send(("report", report))


def _end_by_exit() -> None:
    """Turn SIGTERM into an exit that ends the processes of a hive."""
    signal.signal(signal.SIGTERM, lambda number, _frame: sys.exit(128 + number))
