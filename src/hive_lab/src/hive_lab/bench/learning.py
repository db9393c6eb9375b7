# SPDX-License-Identifier: BSD-3-Clause
"""How well robots predict the time and the energy of their tasks, by the formula and as learned.

Ten robots do 500 random tasks in the hall, with a traffic planner, on virtual time. When half of
the tasks have ended, a wheel of one robot wears and an aisle is closed. One seed is always the
same; nobody has tuned anything on the others, which are drawn anew. The same tasks are done once
more by robots that learn nothing.
"""

from __future__ import annotations

import multiprocessing
import secrets
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from blackboard.costing.track_record import Outcome
from blackboard.domain.task import TaskState
from hive_lab.bench.registry import BenchResult
from hive_lab.fleets.learning_hall import WORN, LearningHall

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from blackboard.costing.saved_experience import SavedExperience
    from blackboard.domain.record import TaskUpdate

    Floats = NDArray[np.float64]

ROBOTS, TASKS = 10, 500
FIXED_SEED = 1
DRAWN = 2  # seeds drawn anew
FIRST = 0.2  # the share of tasks with which robots only begin to learn
LIMIT = 20_000.0  # simulated [s]
WINDOW = 10  # tasks of all over which an error after the change is looked at
OWN_WINDOW = 9  # tasks of one robot, of which each differs in how long it takes
BACK = 1.5  # an error is as before again if it is at most this many times the former one
NEVER = 1e3  # tasks, where it is not within the run

AIMS = {
    "time_median": 0.025,
    "time_95_by_formulas": 0.5,
    "energy_median": 0.015,
    "energy_95": 0.06,
    "time_coverage_off_by": 0.02,
    "energy_coverage_off_by": 0.02,
    "tasks_until_aisle_is_learned": 30.0,
    "tasks_until_wheel_is_learned": 30.0,
}


@dataclass
class Run:
    """What happened with one seed.

    Attributes:
        outcomes: Of all tasks in the order in which they were done, each with its robot.
        changed: How many of them were done before the change.
        done_after: From posting to DONE, by task [s].
        collisions: Contacts.
    """

    outcomes: list[tuple[str, Outcome]] = field(default_factory=list)
    changed: int = 0
    done_after: dict[str, float] = field(default_factory=dict)
    collisions: int = 0


def run(runs: int = DRAWN, robots: int = ROBOTS, tasks: int = TASKS) -> BenchResult:
    """Measure with the fixed seed and `runs` seeds drawn anew.

    Returns:
        Relative errors of time and energy without sign, `_median` and `_95`, of tasks before the
        change but after the first fifth, and the same `_by_formula`; `time_95_by_formulas`, the
        one as a share of the other; shares of tasks that kept the margin, `_coverage`, and how far
        they are from 0.9, `_coverage_off_by`; tasks after which errors are as before the change;
        median time from posting to DONE [s] and the same for robots that learn nothing.
    """
    seeds = [FIXED_SEED, *(secrets.randbelow(2**31) for _ in range(runs))]
    wanted = [(seed, robots, tasks, learns) for seed in seeds for learns in (True, False)]
    with multiprocessing.get_context("fork").Pool() as pool:
        found = pool.starmap(measure, wanted, chunksize=1)
    learned, formula = found[::2], found[1::2]
    figures = {
        **errors_of([_before(each) for each in learned]),
        **coverage_of([_settled(each) for each in learned]),
        **_recovery(learned),
        "done_after": _done_after(learned),
        "done_after_by_formula": _done_after(formula),
        "tasks": float(sum(len(each.done_after) for each in learned)),
        "collisions": float(sum(each.collisions for each in found)),
        **{f"drawn_seed_{number}": float(seed) for number, seed in enumerate(seeds[1:], 1)},
    }
    return BenchResult(figures, AIMS, broken=figures["collisions"] > 0)


def measure(seed: int, robots: int, tasks: int, learns: bool) -> Run:
    """Do the tasks of a seed, with robots that learn from their steps or do not."""
    hall, result = LearningHall(robots, seed), Run()
    posted: dict[str, float] = {}

    def note(robot: str, saved: SavedExperience) -> None:
        if saved.outcomes:
            result.outcomes.append((robot, Outcome(*saved.outcomes[-1])))

    def hear(update: TaskUpdate) -> None:
        now = hall.fleet.network.now
        posted.setdefault(update.task_id, now)
        if update.state is TaskState.DONE:
            result.done_after.setdefault(update.task_id, now - posted[update.task_id])

    for name, robot in hall.fleet.robots.items():
        robot.learning.tell_to(partial(note, name))
        if not learns:
            robot.learning.time_step = _learn_nothing  # type: ignore[assignment, method-assign]
    hall.run(tasks, hear, limit=LIMIT, changes=True)
    result.changed = tasks // 2
    result.collisions = hall.bodies.simulation.collisions
    return result


def _learn_nothing(*_: object) -> Callable[[], None]:
    return lambda: None


def _before(run: Run) -> list[Outcome]:
    """Return the tasks before the change, without those with which robots begin to learn."""
    first = round(FIRST * 2 * run.changed)
    return [outcome for _, outcome in run.outcomes[first : run.changed]]


def _settled(run: Run) -> list[Outcome]:
    """Return all tasks without those with which robots begin to learn."""
    return [outcome for _, outcome in run.outcomes[round(FIRST * 2 * run.changed) :]]


def errors_of(runs: Sequence[Sequence[Outcome]]) -> dict[str, float]:
    """Return the errors of predictions over the tasks of all runs together."""
    table = _table([outcome for run in runs for outcome in run])
    figures = {}
    for name, taken in (("time", table["time"]), ("energy", table["energy"])):
        for word, kind in (("", "predicted"), ("_by_formula", "formula")):
            error = np.abs(table[f"{kind}_{name}"] / taken - 1.0)
            figures[f"{name}_median{word}"] = float(np.median(error))
            figures[f"{name}_95{word}"] = float(np.quantile(error, 0.95))
    figures["time_95_by_formulas"] = figures["time_95"] / figures["time_95_by_formula"]
    return figures


def coverage_of(runs: Sequence[Sequence[Outcome]]) -> dict[str, float]:
    """Return the shares of tasks that took no more than predicted and the margin."""
    table = _table([outcome for run in runs for outcome in run])
    figures = {}
    for name in ("time", "energy"):
        covered = float(np.mean(table[name] <= table[f"most_{name}"]))
        figures[f"{name}_coverage"] = covered
        figures[f"{name}_coverage_off_by"] = abs(covered - 0.9)
    return figures


def _recovery(runs: Sequence[Run]) -> dict[str, float]:
    """Return after how many tasks errors are as before: of all by time, of WORN by energy."""
    aisle, wheel = [], []
    for run in runs:
        first = round(FIRST * 2 * run.changed)
        time = [abs(each.predicted_time / each.time - 1.0) for _, each in run.outcomes]
        aisle.append(tasks_until_as_before(time[first:], run.changed - first))
        own = [(robot == WORN, each) for robot, each in run.outcomes]
        energy = [abs(each.predicted_energy / each.energy - 1.0) for mine, each in own if mine]
        begun = sum(mine for mine, _ in own[:first])
        before = sum(mine for mine, _ in own[: run.changed])
        wheel.append(tasks_until_as_before(energy[begun:], before - begun, OWN_WINDOW))
    return {
        "tasks_until_aisle_is_learned": max(aisle),
        "tasks_until_wheel_is_learned": max(wheel),
    }


def _done_after(runs: Sequence[Run]) -> float:
    return _median([time for run in runs for time in run.done_after.values()])


def tasks_until_as_before(errors: Sequence[float], changed: int, window: int = WINDOW) -> float:
    """Return after how many tasks the median error is as it was before a change.

    Args:
        errors: Relative, without sign, in the order of the tasks.
        changed: How many of them are from before the change.
        window: Over how many tasks the median is taken.
    """
    former, after = _median(errors[:changed]), errors[changed:]
    for number in range(len(after) - window + 1):
        if _median(after[number : number + window]) <= BACK * former:
            return float(number)
    return NEVER


def _table(outcomes: Sequence[Outcome]) -> dict[str, Floats]:
    columns = np.array(outcomes).T
    return dict(zip(Outcome._fields, columns, strict=True))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else float("nan")
