# SPDX-License-Identifier: BSD-3-Clause
"""Shows the progress of a run: a line per robot and a bar over all tasks, or a plain log."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

from blackboard.domain.task import TaskState
from fleet_manager.client.tables import fit, queued

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence
    from typing import TextIO

    from fleet_manager.client.hive_state import HiveState
    from fleet_manager.client.words import Event

_BAR = 30
_STATUS_EVERY = 15.0
_DRAW_EVERY = 0.25


class Progress:
    """Draws in place on a terminal, robots in the order given; elsewhere a line per event."""

    def __init__(self, sink: TextIO, robots: Sequence[str], tasks: Collection[str]) -> None:
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

    def tell(self, events: Iterable[Event], hive: float) -> None:
        """Write events at a time since the start [s, hive's time], unless drawing in place."""
        if not self._live:
            for event in events:
                self.say(f"{hive:6.1f} s  {event.text}")

    def show(self, state: HiveState, wall: float, hive: float) -> None:
        """Redraw the picture, or write a status line, if it is due.

        `wall` and `hive` are the times since the start [s, wall] and [s, hive's time].
        """
        if wall - self._last < (_DRAW_EVERY if self._live else _STATUS_EVERY):
            return
        self._last = wall
        if self._live:
            self._draw([*self._robot_lines(state), self._bar(state, wall, hive)])
        else:
            self.say(self._bar(state, wall, hive))

    def end(self, state: HiveState, wall: float, hive: float) -> None:
        """Draw the last picture and leave it there."""
        self._last = float("-inf")
        self.show(state, wall, hive)
        self._drawn = 0

    def _robot_lines(self, state: HiveState) -> list[str]:
        lines = []
        for name in self._robots:
            row = state.robots.get(name)
            if row is None:
                lines.append(f"  {name:<10} not heard yet")
                continue
            robot = row.status
            record = state.record(robot.task_id)
            step = f"step {min(record.step + 1, record.steps)}/{record.steps}" if record else ""
            waiting = f"{queued(robot)} queued" if queued(robot) else ""
            lines.append(
                f"  {name:<10} {robot.state.name:<8} {robot.task_id or '-':<8} {step:<9} "
                f"({robot.pose.x:5.1f}, {robot.pose.y:5.1f})  battery {robot.charge:6.1%}  "
                f"{waiting}".rstrip()
            )
        return lines

    def _bar(self, state: HiveState, wall: float, hive: float) -> str:
        states = [state.state_of(task_id) for task_id in self._tasks]
        done, working = states.count(TaskState.DONE), states.count(TaskState.STARTED)
        lost = sum(each is not None and each > TaskState.DONE for each in states)
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
