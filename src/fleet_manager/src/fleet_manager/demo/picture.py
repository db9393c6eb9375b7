# SPDX-License-Identifier: BSD-3-Clause
"""Draws a run: driven paths over the map, a timeline of tasks per robot, and the batteries.

Where a traffic planner has told who waits for whom, the map also shows where robots waited.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from blackboard.domain.task import MAX_PRIORITY
from fleet_manager.demo.history import WAIT_GRAIN, RobotTrack
from hive_common.grid_map import UNKNOWN
from hive_common.palette import COLORS, robot_color

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fleet_manager.demo.history import History
    from hive_common.geometry import Array
    from hive_common.grid_map import GridMap
    from hive_common.pose import Pose

_STYLES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
_INK = "#333333"
_QUIET = "#777777"  # of what is only a help to find one's way
_URGENT = "#C00000"
_INCHES = (14.0, 10.5)
_DOTS_PER_INCH = 110
_ROBOTS_IN_LEGEND = 12
_SPREAD = 0.5  # by how much a place where a robot waited is blurred [m]
_FULL_HEAT = 0.2  # what is less than this share of the most is the paler, the less it is


def draw_run(
    path: Path,
    report: dict[str, Any],
    history: History,
    chart: GridMap,
    places: Mapping[str, Pose] = MappingProxyType({}),
) -> None:
    """Draw a run, and write it as PNG to a path; the rest as in `figure_of_run`."""
    figure_of_run(report, history, chart, places).savefig(path, dpi=_DOTS_PER_INCH)


def figure_of_run(
    report: dict[str, Any],
    history: History,
    chart: GridMap,
    places: Mapping[str, Pose] = MappingProxyType({}),
) -> Figure:
    """Return the figure of a run: the map, the timeline and the batteries.

    Args:
        report: See `make_report`.
        history: The record of the run.
        chart: The map on which the robots drove.
        places: What has a name on the map.
    """
    # matplotlib takes a second to import, and a demo needs it only once it has run.
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  (see above)
    from matplotlib.colors import to_hex  # noqa: PLC0415  (see above)
    from matplotlib.figure import Figure  # noqa: PLC0415  (see above)

    figure = Figure(figsize=_INCHES, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=[1.75, 1.0], width_ratios=[2.1, 1.0])
    names = [robot["name"] for robot in report["robots"]]
    colours = {name: to_hex(robot_color(name)) for name in names}
    figure.suptitle(
        f"{title(report)}\n{figures(report)}", fontsize=14, color=_INK, fontweight="bold"
    )
    on_map = figure.add_subplot(grid[0, :])
    _draw_places(on_map, places, chart)
    _draw_map(on_map, report, history, chart, colours)
    _draw_timeline(figure.add_subplot(grid[1, 0]), report, history, colours)
    _draw_batteries(figure.add_subplot(grid[1, 1]), history, colours)
    return figure


def title(report: dict[str, Any]) -> str:
    """Return in one line what a run came to."""
    hits = report["collisions"]
    return (
        f"{report['scenario']}: {report['done']} of {len(report['tasks'])} tasks done by "
        f"{len(report['robots'])} robots in {report['time']['hive']:.0f} s, "
        f"{hits or 'no'} collision{'' if hits == 1 else 's'}"
    )


def figures(report: dict[str, Any]) -> str:
    """Return in one line how well a run went: throughput, waiting and utilization."""
    found = report["summary"]
    told = {
        "{:.0f} tasks per hour": found["tasks_per_hour"],
        "mean waiting {:.0f} s": found["mean_waiting"],
        "longest {:.0f} s": found["longest_waiting"],
        "robots at work {:.0%} of the time": found["utilization"],
    }
    return ", ".join(text.format(value) for text, value in told.items() if value is not None)


def _draw_places(axes: Axes, places: Mapping[str, Pose], chart: GridMap) -> None:
    """Write the names of the places that lie on the map."""
    left, low, right, high = chart.bounds
    for name, pose in places.items():
        if left < pose.x < right and low < pose.y < high:
            axes.plot(pose.x, pose.y, "+", color=_QUIET, ms=5, mew=1.0, zorder=3)
            axes.annotate(
                name, (pose.x, pose.y), xytext=(0, -9), textcoords="offset points", fontsize=7,
                color=_QUIET, ha="center", style="italic", zorder=3,
            )  # fmt: skip


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
        style = _style(index)
        label = f"{name} ({robot['model']}): {robot['distance']:.0f} m, {robot['done']} tasks"
        axes.plot(xs, ys, color=colours[name], lw=1.8, ls=style, alpha=0.85, label=label)
        axes.plot(xs[0], ys[0], "o", color=colours[name], ms=9, mec="white", mew=1.5, zorder=4)
        axes.plot(xs[-1], ys[-1], "s", color=colours[name], ms=9, mec="white", mew=1.5, zorder=4)
    box = {"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8}
    urgent = _urgent_goals(report)
    for place, ids in _goal_labels(report).items():
        ink, weight = (_URGENT, "bold") if place in urgent else (_INK, "normal")
        axes.plot(*place, "x", color=ink, ms=6, mew=1.6, zorder=5)
        axes.annotate(
            ids, place, xytext=(5, 4), textcoords="offset points", fontsize=7.5, color=ink,
            fontweight=weight, zorder=6, bbox=box,
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
    for task in by_urgency(report):
        for number, goal in enumerate(task["goals"]):
            letter = chr(ord("A") + number) if number < 26 else str(number + 1)  # noqa: PLR2004  (letters)
            at.setdefault(_spot(goal), []).append(f"{task['id']}.{letter}")
    return {
        place: "\n".join(" ".join(ids[i : i + 3]) for i in range(0, len(ids), 3))
        for place, ids in at.items()
    }


def by_urgency(report: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the tasks of a report, those of the highest priority first."""
    return sorted(report["tasks"], key=lambda task: -task["priority"])


def is_urgent(task: dict[str, Any]) -> bool:
    """Return whether a task has the highest priority, which may interrupt others."""
    return bool(task["priority"] == MAX_PRIORITY)


def _urgent_goals(report: dict[str, Any]) -> set[tuple[float, float]]:
    return {_spot(goal) for task in report["tasks"] if is_urgent(task) for goal in task["goals"]}


def _spot(goal: dict[str, float]) -> tuple[float, float]:
    """Return where a goal is, so that goals at one place share a label [m]."""
    return round(goal["x"], 1), round(goal["y"], 1)


def _style(index: int) -> Any:  # noqa: ANN401  (matplotlib's)
    """Return the line of a robot; robots of one colour have different ones."""
    return _STYLES[index // len(COLORS) % len(_STYLES)]


def _draw_timeline(
    axes: Axes,
    report: dict[str, Any],
    history: History,
    colours: dict[str, str],
) -> None:
    """Draw which robot worked on which task, one row a robot, the first on top."""
    from matplotlib.patches import Patch  # noqa: PLC0415  (see figure_of_run)

    names = list(colours)
    tasks = {task["id"]: task for task in report["tasks"]}
    length = max(report["time"]["hive"], 1.0)
    for span in history.spans:
        end = span.end if span.end is not None else length
        row = names.index(span.robot) if span.robot in names else len(names)
        colour = colours.get(span.robot, "gray")
        task = tasks.get(span.task_id, {"type": "", "priority": 0})
        hatch = "///" if task["type"] in {"GPA", "GPAB"} else ""
        edge, width = (_URGENT, 2.5) if is_urgent(task) else ("white", 1.0)
        axes.barh(
            row, end - span.begin, left=span.begin, height=0.62, alpha=0.9, edgecolor=edge,
            linewidth=width, color=colour, hatch=hatch,
        )  # fmt: skip
        label = f"{span.task_id} p{task['priority']}" if task["priority"] else span.task_id
        if (end - span.begin) / length > 0.018 * len(label):
            axes.text(
                (span.begin + end) / 2, row, label, ha="center", va="center", fontsize=8,
                color=_INK, fontweight="bold",
                bbox={"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.8},
            )  # fmt: skip
    axes.set_yticks(range(len(names)), names)
    axes.set(xlim=(0, length), ylim=(len(names) - 0.45, -0.55), xlabel="time [s]")
    axes.set_title("tasks per robot (p: priority)", loc="left")
    axes.grid(axis="x", alpha=0.3)
    axes.set_axisbelow(True)
    _frame(axes)
    is_one = any(map(is_urgent, report["tasks"]))
    urgent = [Patch(fc="none", ec=_URGENT, lw=2.5, label=f"urgent (p{MAX_PRIORITY})")] * is_one
    axes.legend(
        handles=[
            Patch(fc="gray", ec="white", hatch="///", label="with arm (GPA, GPAB)"),
            *urgent,
        ],
        loc="upper right", bbox_to_anchor=(1.0, 1.14), frameon=False, fontsize=8, ncols=2,
    )  # fmt: skip


def _draw_batteries(axes: Axes, history: History, colours: dict[str, str]) -> None:
    """Draw the charge of each robot over time, with what it has used."""
    for index, (name, colour) in enumerate(colours.items()):
        charges = history.tracks.get(name, RobotTrack()).charges
        if not charges:
            continue
        times, levels = zip(*charges, strict=True)
        percent = [100 * level for level in levels]
        label = f"{name}: {percent[0] - percent[-1]:.1f} % used"
        axes.plot(times, percent, color=colour, ls=_style(index), lw=1.8, label=label)
    axes.set(xlabel="time [s]", ylabel="charge [%]", title="batteries", ylim=(0, 104))
    axes.ticklabel_format(useOffset=False)
    axes.grid(alpha=0.3)
    _frame(axes)
    if 0 < len(colours) <= _ROBOTS_IN_LEGEND:
        axes.legend(loc="lower left", frameon=False, fontsize=8)


def _frame(axes: Axes) -> None:
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
