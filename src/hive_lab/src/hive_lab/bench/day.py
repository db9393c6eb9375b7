# SPDX-License-Identifier: BSD-3-Clause
"""A day of a fleet: a task every two minutes, and robots that charge by themselves.

The hive consists of the real classes on virtual time; its robots are estimated, not simulated.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.load import random_tasks
from hive_common.pose import Pose
from hive_lab.bench.registry import BenchResult
from hive_lab.fleets.reckoned_bodies import ReckonedBodies
from hive_lab.fleets.virtual_fleet import VirtualFleet
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskUpdate

HOURS = 24.0
PICTURE = Path("day.png")

APART = 120.0  # time between tasks [s]
LOOK = 7.0  # time between samples of the robots' states [s]; never in step with the tasks
PATIENCE = 3600.0  # longest wait for unfinished tasks at the end of the day [s]
AIMS = {"stranded": 0.0, "not_done": 0.0}


@dataclass
class Day:
    """The course of a day.

    Attributes:
        hours: Its length [h].
        statuses: Of each robot, one every `LOOK`, by name.
        posted: When each task was posted [s].
        waited: Time from posting to DONE of each task [s].
        stranded: Robots with an empty battery or an unwanted load, with their words.
    """

    hours: float
    statuses: dict[str, list[RobotStatus]] = field(default_factory=dict)
    posted: dict[str, float] = field(default_factory=dict)
    waited: dict[str, float] = field(default_factory=dict)
    stranded: set[str] = field(default_factory=set)

    @property
    def length(self) -> float:
        """Its length [s]."""
        return self.hours * 3600.0

    def is_over(self, now: float) -> bool:
        """Return whether it has passed and every task is done."""
        return now >= self.length and len(self.waited) == len(self.posted)

    def hear(self, update: TaskUpdate, now: float) -> None:
        """Record an update."""
        if update.state is TaskState.DONE and update.task_id not in self.waited:
            self.waited[update.task_id] = now - self.posted[update.task_id]

    def note(self, status: RobotStatus) -> None:
        """Record a status."""
        self.statuses.setdefault(status.robot_id, []).append(status)
        if status.state is RobotState.DEFECT:
            self.stranded.add(f"{status.robot_id}: {status.reason}")

    def share(self, robot: str, state: RobotState) -> float:
        """Return the share of the day that a robot spent in a state."""
        return float(np.mean([status.state is state for status in self.statuses[robot]]))


def live(hours: float = HOURS, seed: int = 1) -> Day:
    """Let a day of some hours pass in the lab; `seed` draws tasks and drive times."""
    random = np.random.default_rng(seed)
    chargers = {place.name: Pose(*place.pose) for place in load_world("lab").chargers}
    fleet = VirtualFleet(read_fleet("lab"), "lab", ReckonedBodies(random), chargers)
    day = Day(hours)
    fleet.watch(lambda update: day.hear(update, fleet.network.now))
    tasks = random_tasks(fleet.grid, random, avoid=chargers.values())
    while fleet.network.now < day.length + PATIENCE and not day.is_over(fleet.network.now):
        if fleet.network.now >= len(day.posted) * APART and fleet.network.now < day.length:
            task = next(tasks)
            day.posted[task.id] = fleet.network.now
            fleet.post(task)
        fleet.run(LOOK)
        for status in fleet.statuses.values():
            day.note(status)
    return day


def run(hours: float = HOURS, seed: int = 1, picture: Path = PICTURE) -> BenchResult:
    """Measure a day of some hours, and draw it.

    Returns:
        `tasks` posted, `not_done` of them, robots `stranded`, times from posting to DONE `median`
        and `longest` [s]; of each robot the shares of the day it was `busy` and `charging`, its
        least `charge`, 0..1, and its number of `charges`.
    """
    day = live(hours, seed)
    figures = {
        "tasks": float(len(day.posted)),
        "not_done": float(len(day.posted) - len(day.waited)),
        "stranded": float(len(day.stranded)),
        "median": float(np.median([*day.waited.values()])),
        "longest": max(day.waited.values()),
    }
    for robot, statuses in day.statuses.items():
        at_charger = np.array([status.state is RobotState.CHARGING for status in statuses])
        figures |= {
            f"{robot}_busy": day.share(robot, RobotState.BUSY),
            f"{robot}_charging": float(at_charger.mean()),
            f"{robot}_charges": float(np.count_nonzero(np.diff(at_charger.astype(int)) == 1)),
            f"{robot}_charge": min(status.charge for status in statuses),
        }
    draw_day(picture, day)
    click.echo(f"drawn in {picture}", err=True)
    return BenchResult(figures, AIMS)


_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Safe for colour-blind readers (Okabe and Ito, 2008); repeats after the last."""

_STATES = {
    RobotState.BUSY: ("at work", "#0072B2"),
    RobotState.CHARGING: ("out of service to charge", "#E69F00"),
    RobotState.DEFECT: ("defect", "#000000"),
}
_INCHES = (14.0, 7.5)
_DOTS_PER_INCH = 100
_HOUR = 3600.0


def draw_day(path: Path, day: Day) -> None:
    """Draw a day into a PNG file."""
    figure = Figure(figsize=_INCHES, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    done, posted = len(day.waited), len(day.posted)
    figure.suptitle(
        f"{day.hours:g} hours: {done} of {posted} tasks done, {len(day.stranded)} robots stranded",
        fontsize=15,
        fontweight="bold",
    )
    batteries, states = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
    _draw_batteries(batteries, day)
    _draw_states(states, day)
    states.set(xlabel="time [h]", xlim=(0.0, day.hours))
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def _draw_batteries(axes: Axes, day: Day) -> None:
    for index, (name, statuses) in enumerate(day.statuses.items()):
        hours = np.arange(1, len(statuses) + 1) * LOOK / _HOUR
        percent = [100.0 * status.charge for status in statuses]
        axes.plot(hours, percent, color=_COLOURS[index % len(_COLOURS)], lw=1.6, label=name)
    axes.set(ylabel="charge [%]", ylim=(0.0, 105.0), title="batteries")
    axes.grid(alpha=0.3)
    axes.legend(loc="lower right", ncols=4, frameon=False)


def _draw_states(axes: Axes, day: Day) -> None:
    for row, statuses in enumerate(day.statuses.values()):
        states = [status.state for status in statuses]
        for state, (_, colour) in _STATES.items():
            inside = np.array([False, *(each is state for each in states), False])
            begins, ends = np.flatnonzero(np.diff(inside.astype(int))).reshape(-1, 2).T
            spans = np.stack([begins, ends - begins], axis=1) * LOOK / _HOUR
            axes.broken_barh(spans.tolist(), (row - 0.35, 0.7), color=colour, lw=0)
    labels = [
        f"{name}: {day.share(name, RobotState.BUSY):.0%} at work, "
        f"{day.share(name, RobotState.CHARGING):.0%} charging"
        for name in day.statuses
    ]
    axes.set_yticks(range(len(labels)), labels)
    axes.set(ylim=(len(labels) - 0.5, -0.5), title="what the robots did")
    axes.legend(
        handles=[Patch(color=colour, label=label) for label, colour in _STATES.values()],
        loc="upper right",
        bbox_to_anchor=(1.0, 1.18),
        ncols=3,
        frameon=False,
    )
