# SPDX-License-Identifier: BSD-3-Clause
"""Shows how a run goes: a line per robot and a bar over all tasks, or plain lines in a log."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Protocol

from blackboard.domain.record import TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.tables import fit, queued
from fleet_manager.client.words import changes

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from fleet_manager.client.hive_view import HiveView, Report

_BAR = 30
_STATUS_EVERY = 15.0
_DRAW_EVERY = 0.25


class Sink(Protocol):
    """Where the progress is written: a terminal or a file."""

    def write(self, text: str, /) -> object:
        """Write a text."""

    def flush(self) -> object:
        """Write it now."""

    def isatty(self) -> bool:
        """Return whether a person looks at it in a terminal."""


class Progress:
    """Draws in place on a terminal; writes a line per event anywhere else."""

    def __init__(self, sink: Sink, robots: Sequence[str], tasks: Collection[str]) -> None:
        """Prepare; nothing is written yet.

        Args:
            sink: Where to write.
            robots: Names, in the order of their lines.
            tasks: Ids of all tasks of the run.
        """
        self._sink = sink
        self._live = sink.isatty()
        self._robots = robots
        self._tasks = tasks
        self._drawn = 0
        self._last = float("-inf")

    def say(self, text: str) -> None:
        """Write a line above the picture."""
        self._erase()
        self._sink.write(f"{text}\n")
        self._sink.flush()

    def tell(self, view: HiveView, report: Report, hive: float) -> None:
        """Write what a report changes, where the picture cannot be drawn in its place.

        Args:
            view: What the hive has said before it.
            report: What it says now.
            hive: Time since the start on the hive's clock [s].
        """
        if not self._live and isinstance(report, TaskUpdate):
            for sentence in changes(view, report):
                self.say(f"{hive:6.1f} s  {sentence}")

    def show(self, view: HiveView, wall: float, hive: float) -> None:
        """Draw the picture anew, or write a status line, if it is time for it.

        Args:
            view: What the hive has said.
            wall: Time since the start on the clock on the wall [s].
            hive: The same on the hive's clock [s].
        """
        if wall - self._last < (_DRAW_EVERY if self._live else _STATUS_EVERY):
            return
        self._last = wall
        if self._live:
            self._draw([*self._robot_lines(view), self._bar(view, wall, hive)])
        else:
            self.say(self._bar(view, wall, hive))

    def end(self, view: HiveView, wall: float, hive: float) -> None:
        """Draw the last picture and leave it standing."""
        self._last = float("-inf")
        self.show(view, wall, hive)
        self._drawn = 0

    def _robot_lines(self, view: HiveView) -> list[str]:
        lines = []
        for name in self._robots:
            robot = view.robots.get(name)
            if robot is None:
                lines.append(f"  {name:<10} not heard yet")
                continue
            record = view.tasks.get(robot.task_id)
            step = f"step {min(record.step + 1, record.steps)}/{record.steps}" if record else ""
            waiting = f"{queued(robot)} queued" if queued(robot) else ""
            lines.append(
                f"  {name:<10} {robot.state.name:<8} {robot.task_id or '-':<8} {step:<9} "
                f"({robot.pose.x:5.1f}, {robot.pose.y:5.1f})  battery {robot.charge:6.1%}  "
                f"{waiting}".rstrip()
            )
        return lines

    def _bar(self, view: HiveView, wall: float, hive: float) -> str:
        states = [view.state_of(task_id) for task_id in self._tasks]
        done = sum(state is TaskState.DONE for state in states)
        working = sum(state is TaskState.STARTED for state in states)
        lost = sum(state is not None and state > TaskState.DONE for state in states)
        full = round(_BAR * done / max(len(states), 1))
        bad = f", {lost} not done" if lost else ""
        return (
            f"  [{'#' * full}{'.' * (_BAR - full)}] {done}/{len(states)} tasks done, "
            f"{working} under way{bad}, {hive:.0f} s (x{hive / wall if wall > 0 else 0:.2f})"
        )

    def _draw(self, lines: list[str]) -> None:
        self._erase()
        lines = fit(lines, shutil.get_terminal_size().columns - 1)
        self._sink.write("\n".join(lines) + "\n")
        self._sink.flush()
        self._drawn = len(lines)

    def _erase(self) -> None:
        if self._drawn:
            self._sink.write(f"\x1b[{self._drawn}A\x1b[J")
            self._drawn = 0
