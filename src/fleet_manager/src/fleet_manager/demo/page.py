# SPDX-License-Identifier: BSD-3-Clause
"""Shows a run on one HTML page: figures, the picture, tasks, robots, and what happened when."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fleet_manager.client.formats import UNKNOWN
from fleet_manager.demo.picture import by_urgency, figures, is_urgent, title
from hive_common import html_page

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

_TASK_HEAD = (
    "task", "priority", "type", "load [kg]", "state", "robot", "waited [s]", "took [s]", "reason",
)  # fmt: skip
_ROBOT_HEAD = (
    "robot", "model", "tasks done", "way [m]", "energy [kJ]", "charge used", "at work",
)  # fmt: skip


def write_page(
    path: Path, report: dict[str, Any], picture: Path, log: Iterable[tuple[float, str]]
) -> None:
    """Write the page of a run; it needs no other file.

    Args:
        path: Where it is written.
        report: See `make_report`.
        picture: The picture of the run, a PNG file.
        log: What happened, each with its time since the start [s, hive's time].
    """
    tasks = by_urgency(report)
    told = report["time"]
    facts = (
        f"{report['description']} World {report['world']}, fleet {report['fleet']}, "
        f"{report['date']}; {told['hive']:.0f} s of simulated time, "
        f"{told['real_time_factor_reached']:g} times real time."
    )
    sections = [
        html_page.heading(figures(report)),
        html_page.picture("driven paths, tasks over time, and batteries", picture),
        html_page.heading("Tasks, the most urgent first"),
        html_page.table(
            _TASK_HEAD,
            map(_task_row, tasks),
            frozenset(number for number, task in enumerate(tasks) if is_urgent(task)),
        ),
        html_page.heading("Robots"),
        html_page.table(_ROBOT_HEAD, map(_robot_row, report["robots"])),
        html_page.heading("What happened"),
        html_page.listing("\n".join(f"{at:7.1f} s  {text}" for at, text in log)),
    ]
    path.write_text(html_page.page(title(report), facts, sections), encoding="utf-8")


def _task_row(task: dict[str, Any]) -> list[str]:
    return [
        task["id"],
        str(task["priority"]),
        task["type"],
        f"{task['payload']:g}",
        task["state"],
        task["robot"] or UNKNOWN,
        _number(task["waiting"]),
        _number(task["duration"]),
        task["reason"],
    ]


def _robot_row(robot: dict[str, Any]) -> list[str]:
    begin, end = robot["charge_at_start"], robot["charge_at_end"]
    used = UNKNOWN if begin is None or end is None else f"{begin - end:.1%}"
    return [
        robot["name"],
        robot["model"],
        str(robot["done"]),
        _number(robot["distance"]),
        f"{robot['energy'] / 1000:.1f}",
        used,
        f"{robot['busy_share']:.0%}",
    ]


def _number(value: float | None) -> str:
    return UNKNOWN if value is None else f"{value:.1f}"
