# SPDX-License-Identifier: BSD-3-Clause
"""Draws the architectures side by side.

    python3 -m hive_lab.bench.architectures.picture runs.jsonl docs/images

draws the runs that `./hive bench architectures --resume runs.jsonl` has kept into
`architectures.png` and `architectures_faults.png`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, ScalarFormatter

from hive_common.errors import FileError
from hive_lab.architectures.hall_trial import PROBED_AT
from hive_lab.architectures.kinds import ARCHITECTURES
from hive_lab.bench.architectures.measure import FAULTY, SIZES, Group, groups, over_seeds, run_name
from hive_lab.bench.kept_runs import KeptRuns

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    Runs = Mapping[Group, Sequence[Mapping[str, Any]]]

_COLOURS = ("#E69F00", "#56B4E9", "#0072B2", "#D55E00", "#009E73")
"""Safe for colour-blind readers (Okabe and Ito, 2008)."""

_STYLES = ("o-", "s-", "D-", "^--", "v--")  # solid lines are hives

_PANELS = (
    ("time_to_done", 1.0, "time to done, mean [s]", "linear"),
    ("time_to_done_95", 1.0, "time to done, 95th percentile [s]", "linear"),
    ("energy", 1e-3, "energy for each task [kJ]", "linear"),
    ("messages", 1.0, "messages for each task", "log"),
    ("busiest", 1e3, "processor time of the busiest node\nfor each task [ms]", "log"),
    ("all", 1e3, "processor time of all nodes\nfor each task [ms]", "log"),
)
"""Figure, factor, title and scale of each panel."""

_TITLES = {
    "usual": "nothing goes wrong",
    "killed": "the coordinator is killed after a minute",
    "loss": "one message in five is lost",
}
_DOTS_PER_INCH = 110


def read(file: Path) -> Runs:
    """Return the runs of a file that `--resume` has written, by what they have in common.

    Raises:
        FileError: It holds something else, or some of the runs are missing.
    """
    kept = KeptRuns(file)
    known = set(kept.names)
    runs: dict[Group, list[Mapping[str, Any]]] = {}
    for group in groups(SIZES, FAULTY):
        seed = 1
        while (name := run_name(group, seed)) in known:
            runs.setdefault(group, []).append(kept[name])
            seed += 1
        if group not in runs:
            raise FileError(
                f"{file}: no run {run_name(group, 1)!r}; "
                f"`./hive bench architectures --resume {file}` makes all that are missing"
            )
    return runs


def draw_figures(runs: Runs, path: Path) -> None:
    """Draw the figures over the size of the fleet into a PNG file."""
    figure = Figure(figsize=(13.0, 7.4), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    sizes = sorted({group.robots for group in runs})
    for axes, (name, factor, title, scale) in zip(
        figure.subplots(2, 3).flat, _PANELS, strict=True
    ):
        for (key, kind), style, colour in zip(
            ARCHITECTURES.items(), _STYLES, _COLOURS, strict=True
        ):
            values = [factor * over_seeds(runs[Group(size, "usual", key)])[name] for size in sizes]
            axes.plot(sizes, values, style, color=colour, label=kind.title, ms=5)
        axes.set(title=title, xscale="log", yscale=scale, xlabel="robots")
        axes.title.set_fontsize(10)
        axes.set_xticks(sizes, list(map(str, sizes)))
        axes.minorticks_off()
        if scale == "linear":
            axes.set_ylim(bottom=0.0)
        else:
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.grid(alpha=0.3)
    figure.axes[1].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def draw_faults(runs: Runs, robots: int, path: Path) -> None:
    """Draw how many tasks a fleet of one size has done over time, under each condition."""
    figure = Figure(figsize=(13.0, 4.2), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    for axes, (condition, title) in zip(
        figure.subplots(1, len(_TITLES), sharey=True), _TITLES.items(), strict=True
    ):
        for key, style, colour in zip(ARCHITECTURES, _STYLES, _COLOURS, strict=True):
            found = runs[Group(robots, condition, key)]
            _draw_done(axes, found, style[1:], colour, ARCHITECTURES[key].title)
        if condition == "killed":
            axes.axvline(PROBED_AT, color="#777777", lw=1.0, ls=":")
        axes.set(title=title, xlabel="time since the first task [s]", ylim=(0.0, 1.02))
        axes.title.set_fontsize(10)
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel(f"share of the tasks done, {robots} robots")
    figure.axes[-1].legend(loc="lower right", frameon=False, fontsize=9)
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def _draw_done(
    axes: Axes, runs: Sequence[Mapping[str, Any]], style: str, colour: str, title: str
) -> None:
    """Draw the share of all tasks that is done, over all seeds together."""
    tasks = sum(len(run["posted"]) for run in runs)
    ends = np.sort(np.concatenate([run["ended"] for run in runs]))
    times = np.append(ends, 1.02 * max(max(run["posted"]) + 200.0 for run in runs))
    share = np.append(np.arange(1, len(ends) + 1), len(ends)) / tasks
    axes.step(times, share, style, where="post", color=colour, label=title, lw=1.4)


def main() -> None:
    """Draw the runs of one file into a folder."""
    file, folder = map(Path, sys.argv[1:3])
    try:
        runs = read(file)
    except FileError as error:
        sys.exit(str(error))
    draw_figures(runs, folder / "architectures.png")
    draw_faults(runs, FAULTY[-1], folder / "architectures_faults.png")


if __name__ == "__main__":
    main()
