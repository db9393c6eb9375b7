# SPDX-License-Identifier: BSD-3-Clause
"""Draws a day of a fleet: the robots' batteries and states."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from blackboard.domain.characteristics import RobotState
from hive_lab.bench.day import LOOK

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from hive_lab.bench.day import Day

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
