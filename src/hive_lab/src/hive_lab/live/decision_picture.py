# SPDX-License-Identifier: BSD-3-Clause
"""Draws the cost of central and distributed decisions over the size of the fleet.

    python3 -m hive_lab.live.decision_picture decision.json docs/images/decision.png

draws the file that `./hive bench decision --json decision.json` has written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

_COLOURS = {"distributed": "#0072B2", "centralized": "#D55E00"}
"""Safe for colour-blind readers (Okabe and Ito, 2008)."""

_STYLES = {
    "all": ("-", "all members"),
    "blackboard": ("--", "blackboard"),
    "robot": (":", "robot"),
}
_TITLES = {"straight": "as the crow flies", "map": "warehouse map"}
_TICKS = (2, 5, 10, 20, 50, 100)
_DOTS_PER_INCH = 110


def draw(figures: Mapping[str, float], path: Path) -> None:
    """Draw the figures of `hive_lab.live.decision.run` into a PNG file."""
    figure = Figure(figsize=(14.5, 4.2), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    size, *times, key = figure.subplots(1, 4, gridspec_kw={"width_ratios": (1, 1, 1, 0.6)})
    for decision, colour in _COLOURS.items():
        robots, values = _line(figures, "straight", decision, "bytes")
        size.plot(robots, [v / 1000.0 for v in values], "o-", color=colour, label=decision)
    size.set(title="calls and answers, each counted once", ylabel="kB for each task")
    for axes, way in zip(times, _TITLES, strict=True):
        _draw_times(axes, figures, way)
    for axes in (size, *times):
        axes.set(xscale="log", yscale="log", xlabel="robots")
        axes.set_xticks(_TICKS, list(map(str, _TICKS)))
        axes.minorticks_off()
        axes.grid(alpha=0.3)
    size.legend(frameon=False, fontsize=9)
    lines, labels = times[0].get_legend_handles_labels()
    key.axis("off")
    key.legend(lines, labels, loc="center left", frameon=False, fontsize=9)
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def _draw_times(axes: Axes, figures: Mapping[str, float], way: str) -> None:
    for decision, colour in _COLOURS.items():
        for who, (style, words) in _STYLES.items():
            robots, values = _line(figures, way, decision, who)
            label = f"{decision}: {'busiest ' if who == 'robot' else ''}{words}"
            milliseconds = [1000.0 * value for value in values]
            axes.plot(robots, milliseconds, style, marker="o", color=colour, label=label)
    axes.set(title=f"processor time, {_TITLES[way]}", ylabel="ms for each task")


def _line(
    figures: Mapping[str, float], way: str, decision: str, what: str
) -> tuple[list[int], list[float]]:
    """Return numbers of robots and the values at them."""
    end = f"_{decision}_{what}"
    found = {
        int(name.split("_")[1]): value
        for name, value in figures.items()
        if name.startswith(f"{way}_") and name.endswith(end)
    }
    robots = sorted(found)
    return robots, [found[number] for number in robots]


def main() -> None:
    """Draw the figures of one file into another."""
    source, target = map(Path, sys.argv[1:3])
    draw(json.loads(source.read_text(encoding="utf-8"))["figures"], target)


if __name__ == "__main__":
    main()
