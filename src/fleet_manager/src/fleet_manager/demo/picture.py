# SPDX-License-Identifier: BSD-3-Clause
"""Draws a run: driven paths over the map, a timeline of tasks per robot, and the batteries.

Where a traffic planner has told who waits for whom, the map also shows where robots waited.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from fleet_manager.demo.history import WAIT_GRAIN, RobotTrack
from hive_common.grid_map import UNKNOWN

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from fleet_manager.demo.history import History
    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8C6D31", "#5E4FA2")
"""Colour-blind people can distinguish them too (Okabe and Ito, 2008)."""

_STYLES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
_INK = "#333333"
_INCHES = (14.0, 10.5)
_DOTS_PER_INCH = 110
_ROBOTS_IN_LEGEND = 12
_SPREAD = 0.5  # by how much a place where a robot waited is blurred [m]
_FULL_HEAT = 0.2  # what is less than this share of the most is the paler, the less it is


def draw_run(path: Path, report: dict[str, Any], history: History, chart: GridMap) -> None:
    """Draw a run on the map on which the robots drove, and write it as PNG."""
    # matplotlib takes a second to import, and a demo needs it only once it has run.
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (see above)
    from matplotlib.figure import Figure  # noqa: PLC0415  (see above)

    figure = Figure(figsize=_INCHES, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.75, 1.0], width_ratios=[2.1, 1.0])
    names = [robot["name"] for robot in report["robots"]]
    colours = {name: _COLOURS[index % len(_COLOURS)] for index, name in enumerate(names)}
    figure.suptitle(_title(report), fontsize=15, color=_INK, fontweight="bold")
    _draw_map(figure.add_subplot(grid[0, :]), report, history, chart, colours)
    _draw_timeline(figure.add_subplot(grid[1, 0]), report, history, colours)
    _draw_batteries(figure.add_subplot(grid[1, 1]), history, colours)
    figure.savefig(path, dpi=_DOTS_PER_INCH)


def _title(report: dict[str, Any]) -> str:
    hits = report["collisions"]
    return (
        f"{report['scenario']}: {report['done']} of {len(report['tasks'])} tasks done by "
        f"{len(report['robots'])} robots in {report['time']['hive']:.0f} s, "
        f"{hits or 'no'} collision{'' if hits == 1 else 's'}"
    )


def _draw_map(
    axes: Axes,
    report: dict[str, Any],
    history: History,
    chart: GridMap,
    colours: dict[str, str],
) -> None:
    """Draw the map, each robot's path on it, and the goals of the tasks."""
    shade = np.where(chart.cells == UNKNOWN, 0.15, chart.cells * 0.0075)
    left, low, right, high = chart.bounds
    axes.imshow(
        shade, cmap="gray_r", vmin=0, vmax=1, origin="lower", extent=(left, right, low, high),
        interpolation="nearest",
    )  # fmt: skip
    _draw_waits(axes, history, chart)
    for index, robot in enumerate(report["robots"]):
        name = robot["name"]
        places = history.tracks.get(name, RobotTrack()).path
        if not places:
            continue
        xs, ys = zip(*places, strict=True)
        style = _STYLES[index // len(_COLOURS) % len(_STYLES)]
        label = f"{name} ({robot['model']}): {robot['distance']:.0f} m, {robot['done']} tasks"
        axes.plot(xs, ys, color=colours[name], lw=1.8, ls=style, alpha=0.85, label=label)
        axes.plot(xs[0], ys[0], "o", color=colours[name], ms=9, mec="white", mew=1.5, zorder=4)
        axes.plot(xs[-1], ys[-1], "s", color=colours[name], ms=9, mec="white", mew=1.5, zorder=4)
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8}
    for place, ids in _goal_labels(report).items():
        axes.plot(*place, "x", color=_INK, ms=6, mew=1.6, zorder=5)
        axes.annotate(
            ids, place, xytext=(5, 4), textcoords="offset points", fontsize=7.5, color=_INK,
            zorder=6, bbox=box,
        )  # fmt: skip
    axes.set(xlabel="x [m]", ylabel="y [m]", title="driven paths (● start, ■ end, × goal)")
    axes.set_aspect("equal")
    if 0 < len(colours) <= _ROBOTS_IN_LEGEND:
        axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize=10)


def _draw_waits(axes: Axes, history: History, chart: GridMap) -> None:
    """Draw as a heat map where robots have waited for each other."""
    heat = congestion(history, chart)
    if heat is None:
        return
    left, low, right, high = chart.bounds
    opaque = np.minimum(0.8, heat / (_FULL_HEAT * heat.max()))
    drawn = axes.imshow(
        heat, cmap="YlOrRd", vmin=0, alpha=opaque, origin="lower",
        extent=(left, right, low, high), zorder=1.5,
    )  # fmt: skip
    bar = axes.figure.colorbar(drawn, ax=axes, shrink=0.5, pad=0.01, location="left")
    bar.set_label("robots waited here [s per m²]", color=_INK)


def congestion(history: History, chart: GridMap) -> Array | None:
    """Return how long robots have waited for each other [s per m^2], in squares over the map.

    The first row is at the lower edge. A robot stands on more than a point, so what is counted in
    a square is spread around it. None if none has waited on the map.
    """
    left, low, right, high = chart.bounds
    rows, columns = (max(1, round(span / WAIT_GRAIN)) for span in (high - low, right - left))
    heat = np.zeros((rows, columns))
    for (x, y), seconds in history.waited.items():
        row = int((y + 0.5 - low / WAIT_GRAIN) // 1)
        column = int((x + 0.5 - left / WAIT_GRAIN) // 1)
        if 0 <= row < rows and 0 <= column < columns:
            heat[row, column] += seconds
    if not heat.any():
        return None
    spread: Array = ndimage.gaussian_filter(heat, _SPREAD / WAIT_GRAIN) / WAIT_GRAIN**2
    return spread


def _goal_labels(report: dict[str, Any]) -> dict[tuple[float, float], str]:
    """Return the label of each goal: `T1.A T7.B`, three to a line."""
    at: dict[tuple[float, float], list[str]] = {}
    for task in report["tasks"]:
        for number, goal in enumerate(task["goals"]):
            letter = chr(ord("A") + number) if number < 26 else str(number + 1)  # noqa: PLR2004  (letters)
            place = (round(goal["x"], 1), round(goal["y"], 1))
            at.setdefault(place, []).append(f"{task['id']}.{letter}")
    return {
        place: "\n".join(" ".join(ids[i : i + 3]) for i in range(0, len(ids), 3))
        for place, ids in at.items()
    }


def _draw_timeline(
    axes: Axes,
    report: dict[str, Any],
    history: History,
    colours: dict[str, str],
) -> None:
    """Draw which robot worked on which task, one row a robot, the first on top."""
    from matplotlib.patches import Patch  # noqa: PLC0415  (see draw_run)

    names = list(colours)
    kinds = {task["id"]: task["type"] for task in report["tasks"]}
    length = max(report["time"]["hive"], 1.0)
    for span in history.spans:
        end = span.end if span.end is not None else length
        row = names.index(span.robot) if span.robot in names else len(names)
        colour = colours.get(span.robot, "gray")
        hatch = "///" if kinds.get(span.task_id) in {"GPA", "GPAB"} else ""
        axes.barh(
            row, end - span.begin, left=span.begin, height=0.62, alpha=0.9, edgecolor="white",
            color=colour, hatch=hatch,
        )  # fmt: skip
        if (end - span.begin) / length > 0.018 * len(span.task_id):
            axes.text(
                (span.begin + end) / 2, row, span.task_id, ha="center", va="center", fontsize=8,
                color="white", fontweight="bold",
                bbox={"boxstyle": "round,pad=0.12", "fc": colour, "ec": "none"},
            )  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    axes.set(xlim=(0, length), ylim=(len(names) - 0.45, -0.55), xlabel="time [s]")
    axes.set_title("tasks per robot")
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)
    _frame(axes)
    axes.legend(
        handles=[Patch(fc="gray", ec="white", hatch="///", label="with arm (GPA, GPAB)")],
        loc="upper right", bbox_to_anchor=(1.0, 1.12), frameon=False, fontsize=8,
    )  # fmt: skip


def _draw_batteries(axes: Axes, history: History, colours: dict[str, str]) -> None:
    """Draw the charge of each robot over time."""
    for index, (name, colour) in enumerate(colours.items()):
        charges = history.tracks.get(name, RobotTrack()).charges
        if not charges:
            continue
        times, levels = zip(*charges, strict=True)
        style = _STYLES[index // len(_COLOURS) % len(_STYLES)]
        percent = [100 * level for level in levels]
        axes.plot(times, percent, color=colour, ls=style, lw=1.8, label=name)
    axes.set(xlabel="time [s]", ylabel="charge [%]", title="batteries")
    axes.ticklabel_format(useOffset=False)
    axes.grid(alpha=0.3)
    _frame(axes)
    if 0 < len(colours) <= _ROBOTS_IN_LEGEND:
        axes.legend(loc="lower left", frameon=False, fontsize=8)


def _frame(axes: Axes) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
