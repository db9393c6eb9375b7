# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner is worth: on standard grids, in the simulator, and when things fail."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import statistics
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import click

from hive_lab.bench.registry import BenchResult
from hive_lab.fleets import fault_runs
from hive_lab.fleets.crowd import MODELS
from hive_lab.fleets.sites import SITES
from hive_lab.fleets.throughput import Throughput, TimeAlone, Trouble, measure, share_kept
from hive_lab.mapf.grid_file import read_map, read_scenario, read_task_places
from hive_lab.mapf.grid_paths import mistakes
from hive_lab.mapf.one_shot import solve
from hive_lab.mapf.pickup_delivery import draw_tasks, serve
from hive_lab.mapf.rolling_planner import RollingPlanner

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from hive_lab.mapf.grid_file import Grid

MINUTES = 10  # simulated
ALONE = 1800.0  # how long one robot alone drives [s]

ONE_SHOT = {50: (1.03, 1.0), 100: (1.05, 2.0), 200: (1.10, 5.0)}
"""By the number of robots: aims of the cost over its lower bound, and of the time [s]."""

MOST_STEPS = 2000  # a one-shot problem that takes more is not solved


class _Cell(NamedTuple):
    """A case of pickup and delivery, and the figures of others: makespan and service time.

    They were measured with the authors' programs. TP: Ma et al., Lifelong Multi-Agent Path Finding
    for Online Pickup and Delivery Tasks, AAMAS 2017. PIBT: Okumura et al., Priority inheritance
    with backtracking for iterative multi-agent path finding, Artificial Intelligence 310, 2022.
    """

    frequency: float  # tasks a step
    robots: int
    token_passing: tuple[float, float]
    pibt: tuple[float, float]


PICKUP_DELIVERY = (
    _Cell(0.2, 10, (2534, 39.7), (2636, 30.4)),
    _Cell(1.0, 30, (580, 46.8), (545, 30.9)),
    _Cell(2.0, 50, (405, 69.8), (323, 39.5)),
    _Cell(10.0, 10, (1154, 521), (1120, 507)),
    _Cell(10.0, 30, (463, 194), (429, 175)),
    _Cell(10.0, 50, (350, 131), (291, 114)),
)
TASKS = 500
TASK_SEEDS = (1, 2, 3)  # of the tasks; figures are means
STEPS_PER_PLAN = 5
NEAR_PIBT = 1.03  # the most that a makespan may be over PIBT's

LD60 = ("ld60",)


class _Fleet(NamedTuple):
    """A fleet in the simulator, and the share of its throughput that it may lose."""

    site: str
    robots: int
    models: tuple[str, ...]
    loses: float | None


FLEETS = (
    _Fleet("warehouse", 10, LD60, 0.03),
    _Fleet("warehouse", 30, LD60, 0.07),
    _Fleet("warehouse", 50, LD60, 0.12),
    _Fleet("lab", 4, LD60, 0.02),
    _Fleet("lab", 8, LD60, 0.07),
    _Fleet("hall", 40, MODELS, None),
)
LONGEST_STAND = 30.0  # [s]


def run(
    map: Path | None = None,  # noqa: A002  (the name of the option)
    scen: Sequence[Path] = (),
    faults: int = 0,
    minutes: int = MINUTES,
    runs: int = 1,
    local: bool = False,
    people: int = 0,
    close: bool = False,
) -> BenchResult:
    """Measure the planner alone on files, or runs with faults, or else fleets in the simulator.

    Args:
        map: A movingai map.
        scen: What to plan on it: scenarios, `.scen`, or places of pickup and delivery, `.pd`.
        faults: How many runs with faults to simulate.
        minutes: How long each fleet drives, simulated.
        runs: How many seeds each fleet drives with.
        local: Whether fleets go by the right of way alone.
        people: How many people walk about among each fleet.
        close: Whether a lane of each site closes for the middle third of the time.

    Returns:
        Of a scenario, by robots: 1 if it is `unsolved`, `cost` over that of the shortest paths,
        seconds and processor time [s]. Of pickup and delivery, by tasks a step and robots:
        `makespan` and `service time` [steps], processor time of a plan [ms]. Of a fleet: goals per
        hour and robot, the share that it `loses` of its throughput, contacts, goals given up, the
        longest stand of a robot with a goal [s], the locks that the traffic planner has found,
        processor time for a simulated second [s]. Of faults: contacts, the first seed with one (-1
        if none), the longest stand [s].

    Raises:
        click.UsageError: One of `map` and `scen` is missing.
        FileError: A file cannot be read, or holds something that is not allowed.
    """
    if (map is None) != (not scen):
        raise click.UsageError("--map and --scen need each other")
    if close and local:
        raise click.UsageError("--close needs the traffic planner: leave out --local")
    if map is not None:
        return _on_grids(map, scen)
    if faults:
        return _with_faults(faults)
    return _of_fleets(60.0 * minutes, runs, Trouble(people, close), planned=not local)


def _on_grids(map_file: Path, files: Sequence[Path]) -> BenchResult:
    """Plan on a grid without a simulator."""
    grid = read_map(map_file)
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for file in files:
        part = _pickup_delivery(grid, file) if file.suffix == ".pd" else _one_shot(grid, file)
        for name, value, aim in part:
            figures[f"{file.stem} {name}"] = value
            if aim is not None:
                aims[f"{file.stem} {name}"] = aim
    return BenchResult(figures, aims, any(figures[name] for name in figures if "mistakes" in name))


def _one_shot(grid: Grid, file: Path) -> Iterator[tuple[str, float, float | None]]:
    """Yield figures of a scenario, by name, with their aims."""
    trips = read_scenario(file, grid)
    for robots, (ratio, seconds) in ONE_SHOT.items():
        if robots > len(trips):
            continue
        found = solve(grid, trips[:robots], RollingPlanner.to_the_end, MOST_STEPS)
        yield f"{robots} unsolved", float(not found.solved), 0.0
        yield f"{robots} cost", found.ratio, ratio
        yield f"{robots} seconds", found.wall, seconds
        yield f"{robots} cpu", found.cpu, None
        yield f"{robots} mistakes", float(sum(1 for _ in mistakes(grid, found.paths))), 0.0


def _pickup_delivery(grid: Grid, file: Path) -> Iterator[tuple[str, float, float | None]]:
    """Yield figures of pickup and delivery, by name, with their aims."""
    places = read_task_places(file, grid)
    for cell in PICKUP_DELIVERY:
        if cell.robots > len(places.parking):
            continue
        planners: list[RollingPlanner] = []

        def planner_of(
            where: Grid, robots: int, made: list[RollingPlanner] = planners
        ) -> RollingPlanner:
            made.append(RollingPlanner(where, robots, STEPS_PER_PLAN))
            return made[-1]

        runs = [
            serve(
                grid,
                places,
                draw_tasks(places, TASKS, cell.frequency, seed),
                cell.robots,
                planner_of,
                STEPS_PER_PLAN,
            )
            for seed in TASK_SEEDS
        ]
        name = f"{cell.frequency:g} a step, {cell.robots} robots:"
        least = min(cell.token_passing[0], NEAR_PIBT * cell.pibt[0])
        served = min(cell.token_passing[1], cell.pibt[1])
        yield f"{name} makespan", statistics.mean(each.makespan for each in runs), least
        yield f"{name} service time", statistics.mean(each.service_time for each in runs), served
        yield f"{name} unfinished", float(sum(not each.done for each in runs)), 0.0
        wrong = sum(1 for each in runs for _ in mistakes(grid, each.paths))
        yield f"{name} mistakes", float(wrong), 0.0
        spent = sorted(1000.0 * cpu for planner in planners for cpu in planner.spent)
        yield f"{name} plan cpu median", statistics.median(spent), PLAN_MEDIAN
        yield f"{name} plan cpu p95", spent[int(P95 * (len(spent) - 1))], PLAN_P95


PLAN_MEDIAN, PLAN_P95 = 10.0, 50.0
"""Processor time of one replanning step [ms]."""

P95 = 0.95


def _of_fleets(seconds: float, runs: int, trouble: Trouble, *, planned: bool) -> BenchResult:
    """Measure fleets in the simulator, and each of their robots alone."""
    alone_jobs = sorted({(fleet.site, model) for fleet in FLEETS for model in fleet.models})
    fleet_jobs = list(itertools.product(FLEETS, range(1, runs + 1)))
    results: dict[_Fleet, list[Throughput]] = defaultdict(list)
    with _pool() as pool:
        alone = pool.map(_alone, *zip(*alone_jobs, strict=True))
        driven = pool.map(
            _driven,
            (fleet for fleet, _ in fleet_jobs),
            (seed for _, seed in fleet_jobs),
            itertools.repeat(seconds),
            itertools.repeat(planned),
            itertools.repeat(trouble),
        )
        sites = {name: SITES[name]() for name in SITES}
        times = {
            (site, model): TimeAlone(sites[site], model, found.reached)
            for (site, model), found in zip(alone_jobs, alone, strict=True)
        }
        for (fleet, seed), found in zip(fleet_jobs, driven, strict=True):
            click.echo(f"{fleet.site} {fleet.robots}, seed {seed}: done", err=True)
            results[fleet].append(found)
    figures: dict[str, float] = {}
    aims: dict[str, float] = {}
    for fleet, seeds in results.items():
        of_site = {model: times[fleet.site, model] for model in fleet.models}
        part = _fleet_figures(fleet, seeds, of_site)
        figures |= {f"{fleet.site} {fleet.robots} {name}": part[name][0] for name in part}
        aims |= {
            f"{fleet.site} {fleet.robots} {name}": aim
            for name, (_, aim) in part.items()
            if aim is not None
        }
    contacts = any(value for name, value in figures.items() if name.endswith("contacts"))
    return BenchResult(figures, aims, contacts)


def _fleet_figures(
    fleet: _Fleet, found: Sequence[Throughput], alone: Mapping[str, TimeAlone]
) -> dict[str, tuple[float, float | None]]:
    """Return a fleet's figures with their aims."""
    return {
        "goals per hour and robot": (statistics.mean(each.rate for each in found), None),
        "loses": (1.0 - statistics.mean(share_kept(each, alone) for each in found), fleet.loses),
        "contacts": (float(sum(each.contacts for each in found)), 0.0),
        "wall contacts": (float(sum(each.wall_contacts for each in found)), 0.0),
        "person contacts": (float(sum(each.person_contacts for each in found)), 0.0),
        "given up": (float(sum(each.given_up for each in found)), 0.0),
        "longest stand": (max(each.longest_stand for each in found), LONGEST_STAND),
        "locks": (float(sum(each.locks for each in found)), None),
        "cpu": (statistics.mean(each.cpu for each in found), None),
    }


def _alone(site: str, model: str) -> Throughput:
    return measure(SITES[site](), 1, ALONE, (model,))


def _driven(
    fleet: _Fleet, seed: int, seconds: float, planned: bool, trouble: Trouble
) -> Throughput:
    site, models = SITES[fleet.site](), fleet.models
    return measure(site, fleet.robots, seconds, models, seed, planned=planned, trouble=trouble)


def _with_faults(runs: int) -> BenchResult:
    """Simulate runs in which the planner, messages and positions fail."""
    contacts, first, goals, stand = 0, -1, 0, 0.0
    with _pool() as pool:
        for done in pool.map(fault_runs.run, range(runs)):
            for contact in done.contacts:
                click.echo(f"seed {done.seed}: {contact}", err=True)
            if done.contacts and first < 0:
                first = done.seed
            contacts += len(done.contacts)
            goals += done.goals
            stand = max(stand, done.longest_stand)
    figures = {
        "runs": float(runs),
        "contacts": float(contacts),
        "first seed with a contact": float(first),
        "goals per run": goals / runs,
        "longest stand": stand,
    }
    return BenchResult(figures, {"contacts": 0.0}, contacts > 0)


def _pool() -> ProcessPoolExecutor:
    """Return processes, one for each processor; they share no state with this one."""
    context = multiprocessing.get_context("forkserver")
    return ProcessPoolExecutor(os.cpu_count() or 1, mp_context=context)
