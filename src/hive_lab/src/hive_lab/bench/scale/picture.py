# SPDX-License-Identifier: BSD-3-Clause
"""Draws what a hive costs over its size.

    python3 -m hive_lab.bench.scale.picture scale.json docs/images/scale.png

draws the file that `./hive bench scale --json scale.json` has written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from hive_lab.bench.scale.measure import SIZES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

_COLOURS = {"distributed": "#0072B2", "planned": "#D55E00"}
"""Safe for colour-blind readers (Okabe and Ito, 2008)."""

_PANELS = (
    ("idle_bytes", 1e-3, "all nodes hear without tasks [kB/s]"),
    ("messages", 1.0, "messages for each task"),
    ("bytes", 1e-3, "kB for each task"),
    ("leader", 1e3, "processor time of the leader\nfor each task [ms]"),
    ("all", 1e3, "processor time of all nodes\nfor each task [ms]"),
    ("load", 1.0, "processors that the leader needs,\na task for each robot every two minutes"),
)
"""Figure, factor and title of each panel."""

_DOTS_PER_INCH = 110


def draw(figures: Mapping[str, float], path: Path) -> None:
    """Draw the figures of `measure.run` into a PNG file."""
    figure = Figure(figsize=(13.0, 7.4), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    for axes, (name, factor, title) in zip(figure.subplots(2, 3).flat, _PANELS, strict=True):
        for decision, colour in _COLOURS.items():
            _draw_line(axes, figures, decision, name, factor, colour)
        if name == "load":
            axes.axhline(1.0, color="#777777", lw=1.0, ls=":")
        axes.set(title=title, xscale="log", yscale="log", xlabel="robots")
        axes.title.set_fontsize(10)
        axes.set_xticks(SIZES, list(map(str, SIZES)))
        axes.minorticks_off()
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.grid(alpha=0.3)
        axes.legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def _draw_line(
    axes: Axes,
    figures: Mapping[str, float],
    decision: str,
    name: str,
    factor: float,
    colour: str,
) -> None:
    """Draw one figure over the sizes; its label says how it grows in the end."""
    values = [factor * figures[f"{size}_robots_{decision}_{name}"] for size in SIZES]
    exponent = figures.get(f"{decision}_growth_{name}")
    label = decision if exponent is None else f"{decision}: robots^{round(exponent, 1) + 0.0:.1f}"
    axes.plot(SIZES, values, "o-", color=colour, label=label, ms=5)


def main() -> None:
    """Draw one file of figures."""
    source, target = map(Path, sys.argv[1:3])
    draw(json.loads(source.read_text("utf-8"))["figures"], target)


if __name__ == "__main__":
    main()
