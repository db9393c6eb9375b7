# SPDX-License-Identifier: BSD-3-Clause
"""The figures of runs, and tables of them."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    Report = Mapping[str, Any]  # see fleet_manager.demo.report.make_report


@dataclass(frozen=True)
class Figure:
    """A figure of a run."""

    title: str
    unit: str
    places: int  # decimal places that are shown


FIGURES: Mapping[str, Figure] = {
    "done": Figure("tasks done", "", 0),
    "tasks": Figure("tasks posted", "", 0),
    "done_twice": Figure("tasks done more than once", "", 0),
    "time_to_done": Figure("time to done, mean", "s", 1),
    "time_to_done_95": Figure("time to done, 95th percentile", "s", 1),
    "makespan": Figure("makespan", "s", 1),
    "waiting": Figure("waiting until started, mean", "s", 1),
    "utilisation": Figure("utilisation, mean", "%", 1),
    "distance": Figure("distance driven", "m", 0),
    "energy": Figure("energy", "kJ", 1),
    "collisions": Figure("collisions", "", 0),
}

DRAWN = ("time_to_done", "makespan", "waiting", "utilisation", "energy")
"""Those that are drawn side by side."""


def figures_of(report: Report) -> dict[str, float]:
    """Return the figures of one run by the names of `FIGURES`, NaN where it has none.

    Times count tasks that are done. Only runs on virtual time know what was done more than once.
    """
    done = [task for task in report["tasks"] if task["state"] == "DONE"]
    times = np.array([task["ended"] - task["posted"] for task in done])
    waiting = [task["waiting"] for task in done if task["waiting"] is not None]
    robots = report["robots"]
    first = min((task["posted"] for task in done), default=0.0)
    return {
        "done": float(len(done)),
        "tasks": float(len(report["tasks"])),
        "done_twice": float(report.get("done_twice", math.nan)),
        "time_to_done": float(times.mean()) if done else math.nan,
        "time_to_done_95": float(np.percentile(times, 95)) if done else math.nan,
        "makespan": max(task["ended"] for task in done) - first if done else math.nan,
        "waiting": float(np.mean(waiting)) if waiting else math.nan,
        "utilisation": 100.0 * float(np.mean([robot["busy_share"] for robot in robots])),
        "distance": float(sum(robot["distance"] for robot in robots)),
        "energy": sum(robot["energy"] for robot in robots) / 1000.0,
        "collisions": float(report["collisions"]),
    }


@dataclass(frozen=True)
class Spread:
    """Median, least and greatest of a figure over the runs of a variant; NaN where none has it."""

    median: float
    least: float
    most: float

    @classmethod
    def of(cls, values: Sequence[float]) -> Spread:
        """Return the spread of some values, without those that are NaN."""
        known = [value for value in values if not math.isnan(value)]
        if not known:
            return cls(math.nan, math.nan, math.nan)
        return cls(float(np.median(known)), min(known), max(known))

    def words(self, places: int) -> str:
        """Return it as text: the median, and the range where there is one."""
        if math.isnan(self.median):
            return "-"
        text = f"{self.median:.{places}f}"
        if self.least == self.most:
            return text
        return f"{text} ({self.least:.{places}f}..{self.most:.{places}f})"


Table = dict[str, dict[str, Spread]]
"""The spread of each figure by the label of a variant and the name of the figure."""


def table_of(reports: Mapping[str, Sequence[Report]]) -> Table:
    """Return the table of the runs of each variant, by its label."""
    table: Table = {}
    for label, runs in reports.items():
        found = [figures_of(report) for report in runs]
        table[label] = {name: Spread.of([each[name] for each in found]) for name in FIGURES}
    return table


def title(name: str) -> str:
    """Return the title of a figure with its unit."""
    figure = FIGURES[name]
    return f"{figure.title} [{figure.unit}]" if figure.unit else figure.title


def rows_of(table: Table) -> list[list[str]]:
    """Return a table as texts: a heading, then a row for each figure; a column each variant."""
    rows = [["median (least..most)", *table]]
    for name, figure in FIGURES.items():
        rows.append([title(name), *(row[name].words(figure.places) for row in table.values())])
    return rows


def as_text(table: Table) -> str:
    """Return a table for a terminal."""
    rows = rows_of(table)
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
    return "\n".join(lines) + "\n"


def as_csv(reports: Mapping[str, Sequence[Report]]) -> str:
    """Return the figures of each run as CSV: a line for each run, with a header."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["variant", "seed", *map(title, FIGURES)])
    for label, runs in reports.items():
        for report in runs:
            values = figures_of(report)
            writer.writerow([label, report["seed"], *(f"{values[name]:g}" for name in FIGURES)])
    return text.getvalue()
