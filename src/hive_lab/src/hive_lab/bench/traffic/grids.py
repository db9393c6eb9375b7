# SPDX-License-Identifier: BSD-3-Clause
"""Measures the joint planner alone, on standard grids, against published planners."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, NamedTuple

from hive_lab.bench.registry import BenchResult
from hive_lab.mapf.grid_file import read_map, read_scenario, read_task_places
from hive_lab.mapf.grid_paths import mistakes
from hive_lab.mapf.one_shot import solve
from hive_lab.mapf.pickup_delivery import draw_tasks, serve
from hive_lab.mapf.rolling_planner import RollingPlanner

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from hive_lab.mapf.grid_file import Grid

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

PLAN_MEDIAN, PLAN_P95 = 10.0, 50.0
"""Processor time of one replanning step [ms]."""

P95 = 0.95


def on_grids(map_file: Path, files: Sequence[Path]) -> BenchResult:
    """Plan on a movingai map what scenarios, `.scen`, and places of tasks, `.pd`, ask for.

    Raises:
        FileError: A file cannot be read, or holds something that is not allowed.
    """
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
