# SPDX-License-Identifier: BSD-3-Clause
"""The rules of the task form: which fields a type needs, and what each may hold.

`check` turns the typed texts into a task, or into one mistake per field that says what is allowed
there. Lengths are typed in metres and headings in degrees; a task holds radians (REP-103).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.domain.task import MAX_ID_LENGTH, Task, TaskType
from fleet_manager.client.task_ids import next_task_id
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

    from fleet_manager.desk.facts import MapBounds

GOAL_NAMES = ("A", "B", "C")
MAX_PAYLOAD = 10_000.0  # [kg], well above the heaviest load that an indoor AGV is built for
MAX_COORDINATE = 10_000.0  # [m], where no map is known
_ID = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)", re.ASCII)
_MAX_QUOTED = 24  # characters of a wrong entry that its message repeats

GOALS_TAKEN: Mapping[TaskType, tuple[str, ...]] = {
    TaskType.GA: ("A",),
    TaskType.GAB: ("A", "B", "C"),
    TaskType.GPA: ("A",),
    TaskType.GPAB: ("A", "B"),
}
"""The goals that can be filled in for each type; the first `goals_needed` of them must be."""


@dataclass(frozen=True, slots=True)
class GoalText:
    """One goal as typed: x and y in metres, heading in degrees."""

    x: str = ""
    y: str = ""
    heading: str = ""

    @property
    def is_empty(self) -> bool:
        """Whether nothing has been typed."""
        return not (self.x.strip() or self.y.strip() or self.heading.strip())


@dataclass(frozen=True, slots=True)
class FormText:
    """The whole form as typed; `goals` are A, B and C."""

    id: str
    type: TaskType
    priority: str = "0"
    payload: str = "0"
    goals: tuple[GoalText, ...] = (GoalText(), GoalText(), GoalText())


@dataclass(frozen=True, slots=True)
class Checked:
    """The result of checking a form."""

    task: Task | None  # the task, or None where there are mistakes
    mistakes: Mapping[str, str]  # what is wrong, by field such as `priority`, `A.heading`


@dataclass(frozen=True, slots=True)
class Range:
    """The numbers that a field takes, both ends included."""

    low: float
    high: float
    unit: str = ""
    why: str = ""

    @property
    def allowed(self) -> str:
        """What is allowed, for a person."""
        low, high = (f"{round(end, 3):.10g}" for end in (self.low, self.high))
        return f"{low} to {high} {self.unit}".strip() + self.why


PRIORITY = Range(0, 10)
PAYLOAD = Range(0.0, MAX_PAYLOAD, "kg")
HEADING = Range(-360.0, 360.0, "°")


def goals_needed(kind: TaskType) -> tuple[str, ...]:
    """Return the names of the goals that a type requires."""
    return GOAL_NAMES[: kind.goals_needed]


def check(form: FormText, taken: Collection[str] = (), bounds: MapBounds | None = None) -> Checked:
    """Check a form field by field; return the task, or every mistake at once.

    Goals that the type does not take are left out, whatever they hold. `taken` are the ids in use;
    `bounds` is where the map ends, None where no map is known.
    """
    mistakes: dict[str, str] = {}
    name = _checked_id(form.id.strip(), taken, mistakes)
    priority = _checked_number(form.priority, PRIORITY, "priority", mistakes)
    payload = _checked_number(form.payload, PAYLOAD, "payload", mistakes)
    goals = _checked_goals(form, bounds, mistakes)
    if "priority" not in mistakes and priority != int(priority):
        mistakes["priority"] = _outside(form.priority, PRIORITY)
    if mistakes:
        return Checked(None, mistakes)
    return Checked(Task(name, form.type, goals, int(priority), payload, "map"), {})


def typed_goals(form: FormText) -> dict[str, Pose]:
    """Return the goals that the type takes and that are places, by name [map frame]."""
    goals = {}
    for name, goal in zip(GOALS_TAKEN[form.type], form.goals, strict=False):
        x, y = parsed(goal.x.strip()), parsed(goal.y.strip())
        degrees = parsed(goal.heading.strip() or "0")
        if x is not None and y is not None and degrees is not None:
            pose = Pose(x, y, math.radians(degrees))
            if not pose.flaw:
                goals[name] = pose
    return goals


def _checked_id(name: str, taken: Collection[str], mistakes: dict[str, str]) -> str:
    allowed = f"allowed: 1 to {MAX_ID_LENGTH} letters, digits, - and _"
    if not name:
        mistakes["id"] = f"is empty; {allowed}"
    elif len(name) > MAX_ID_LENGTH or not _ID.fullmatch(name):
        mistakes["id"] = f"“{shortened(name)}” is not an id; {allowed}"
    elif name in taken:
        mistakes["id"] = f"{name} is taken already; {next_task_id(taken)} is free"
    return name


def _checked_goals(
    form: FormText, bounds: MapBounds | None, mistakes: dict[str, str]
) -> tuple[Pose, ...]:
    """Return the goals that the type takes, up to the last that is needed or filled in."""
    taken, needed = GOALS_TAKEN[form.type], goals_needed(form.type)
    x_range, y_range = _map_ranges(bounds)
    goals = []
    for name, goal in zip(taken, form.goals, strict=False):
        if name not in needed and goal.is_empty:
            break
        x = _checked_number(goal.x, x_range, f"{name}.x", mistakes)
        y = _checked_number(goal.y, y_range, f"{name}.y", mistakes)
        typed = goal.heading.strip() or "0"
        heading = _checked_number(typed, HEADING, f"{name}.heading", mistakes)
        goals.append(Pose(x, y, math.remainder(math.radians(heading), math.tau)))
    return tuple(goals)


def _map_ranges(bounds: MapBounds | None) -> tuple[Range, Range]:
    if bounds is None:
        anywhere = Range(-MAX_COORDINATE, MAX_COORDINATE, "m")
        return anywhere, anywhere
    why = ", the map ends there"
    x_range = Range(bounds.x_min, bounds.x_max, "m", why)
    return x_range, Range(bounds.y_min, bounds.y_max, "m", why)


def _checked_number(typed: str, span: Range, field: str, mistakes: dict[str, str]) -> float:
    """Return the number, or 0 with a mistake noted."""
    typed = typed.strip()
    number = parsed(typed)
    if not typed:
        mistakes[field] = f"is empty; allowed: {span.allowed}"
    elif number is None:
        mistakes[field] = f"“{shortened(typed)}” is not a number; allowed: {span.allowed}"
    elif not span.low <= number <= span.high:
        mistakes[field] = _outside(typed, span)
    else:
        return number
    return 0.0


def _outside(typed: str, span: Range) -> str:
    return f"{shortened(typed)} is outside; allowed: {span.allowed}"


def parsed(typed: str) -> float | None:
    """Return a plain decimal number, with a point or a comma, or None for anything else.

    `float` alone would also take `nan`, `inf`, `1_000` and the digits of other scripts.
    """
    return float(typed.replace(",", ".")) if _NUMBER.fullmatch(typed) else None


def shortened(typed: str) -> str:
    """Return an entry short enough for a message."""
    return typed if len(typed) <= _MAX_QUOTED else typed[: _MAX_QUOTED - 1] + "…"
