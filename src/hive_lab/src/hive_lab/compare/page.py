# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of variants side by side, and the HTML page that holds all results."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hive_common import html_page
from hive_lab.compare.figures import DRAWN, FIGURES, rows_of, title

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from hive_lab.compare.figures import Table

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D31", "#5E4FA2")
"""Safe for colour-blind readers (Okabe and Ito, 2008); repeats after the last."""

_COLUMNS = 2
_INCHES_EACH = 5.0
_DOTS_PER_INCH = 100


def draw_side_by_side(path: Path, table: Table) -> None:
    """Draw the figures of variants as bars: the median, and a line from the least to the most."""
    rows = math.ceil(len(DRAWN) / _COLUMNS)
    inches = (_INCHES_EACH * _COLUMNS, rows * (0.9 + 0.45 * len(table)))
    figure = Figure(figsize=inches, layout="constrained")
    FigureCanvasAgg(figure)
    for number, name in enumerate(DRAWN):
        axes = figure.add_subplot(rows, _COLUMNS, number + 1)
        for row, (label, spreads) in enumerate(table.items()):
            spread = spreads[name]
            if math.isnan(spread.median):
                continue
            colour = _COLOURS[row % len(_COLOURS)]
            axes.barh(row, spread.median, height=0.62, color=colour, label=label)
            axes.plot([spread.least, spread.most], [row, row], color="#222222", lw=1.4)
            words = f" {spread.median:.{FIGURES[name].places}f}"
            axes.text(spread.most, row, words, va="center", fontsize=9)
        axes.set_yticks(
            range(len(table)), list(table) if number % _COLUMNS == 0 else [""] * len(table)
        )
        axes.set(ylim=(max(len(table), 1) - 0.5, -0.5), title=title(name))
        axes.title.set_fontsize(10)
        axes.margins(x=0.22)
        axes.set_xlim(left=0.0)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def write_page(
    path: Path,
    name: str,
    facts: str,
    table: Table,
    pictures: Mapping[str, Path],
    sources: Mapping[str, str],
) -> None:
    """Write one HTML file that needs no other.

    Args:
        path: Where it is written.
        name: The heading.
        facts: When and where the runs were made, in a sentence.
        table: The figures.
        pictures: PNG files by their headings.
        sources: The text of each file that the runs were made from, by its name.
    """
    head, *rows = rows_of(table)
    sections = [html_page.table(head, rows)]
    for heading, file in pictures.items():
        sections += [html_page.heading(heading), html_page.picture(heading, file)]
    sections.append(html_page.heading("To repeat it"))
    sections += [html_page.listing(content, file) for file, content in sources.items()]
    path.write_text(html_page.page(name, facts, sections), encoding="utf-8")
