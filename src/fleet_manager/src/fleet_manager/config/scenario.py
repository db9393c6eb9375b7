# SPDX-License-Identifier: BSD-3-Clause
"""Reads scenarios: tasks that are posted to a hive one after the other, at stated times.

The files in `scenarios/` are the manual of the format. A goal is a pose, or the name of a station
or charger of the world that the scenario is made for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from blackboard.domain.task import Task, TaskType
from fleet_manager.config.places import places_of
from hive_common.checked_yaml import error_at, read_checked
from hive_common.pose import Pose
from hive_common.resources import beside, find_file

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping
    from pathlib import Path

_TYPES = [kind.name for kind in TaskType]
_POSE = "[x, y] or [x, y, yaw] in the map frame [m, m, rad], or the name of a place"
_SCHEMA: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["description", "world", "fleet", "tasks"],
    "description": "description, world, map, fleet, time_limit, tasks",
    "properties": {
        "description": {"type": "string", "description": "a sentence"},
        "world": {"type": "string", "description": "the name or path of a world"},
        "map": {"type": "string", "description": "the name or path of a map"},
        "fleet": {"type": "string", "description": "the name or path of a fleet file"},
        "time_limit": {
            "type": "number",
            "exclusiveMinimum": 0,
            "maximum": 86400,
            "description": "a number of seconds over 0, at most 86400",
        },
        "tasks": {
            "type": "array",
            "minItems": 1,
            "description": "a list of at least one task, each with id, type and goals",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["id", "type", "goals"],
                "description": "a task with id, type, goals, priority, payload, after",
                "properties": {
                    "id": {
                        "type": "string",
                        "pattern": r"^[!-~]{1,60}\Z",
                        "description": "1..60 characters without spaces",
                    },
                    "type": {"enum": _TYPES, "description": " | ".join(_TYPES)},
                    "goals": {
                        "type": "array",
                        "minItems": 1,
                        "maxItems": 100,
                        "description": "a list of 1..100 goals",
                        "items": {
                            "type": ["array", "string"],
                            "minItems": 2,
                            "maxItems": 3,
                            "items": {"type": "number", "description": "a number [m, m, rad]"},
                            "description": _POSE,
                        },
                    },
                    "priority": {
                        "type": "integer",
                        "minimum": 0,
                        "maximum": 10,
                        "description": "a whole number, 0..10",
                    },
                    "payload": {
                        "type": "number",
                        "minimum": 0,
                        "description": "a number of kg, at least 0",
                    },
                    "after": {
                        "type": "number",
                        "minimum": 0,
                        "description": "a number of seconds, at least 0",
                    },
                },
            },
        },
    },
}


@dataclass(frozen=True)
class PlannedTask:
    """A task and when it is posted.

    Attributes:
        task: The task.
        after: When it is posted, from the start of the scenario, on the hive's clock [s].
    """

    task: Task
    after: float


@dataclass(frozen=True)
class Scenario:
    """A scenario file's contents.

    Attributes:
        path: The file.
        description: What it is for, in a sentence.
        world: Name or path of the world it is made for.
        map: Name or path of the map that the robots know.
        fleet: Name or path of the fleet that can do it.
        time_limit: After this time on the hive's clock what is not done counts as not done [s].
        tasks: The tasks in the order in which they are posted.
    """

    path: Path
    description: str
    world: str
    map: str
    fleet: str
    tasks: tuple[PlannedTask, ...]
    time_limit: float = 600.0

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.path.stem


def read_scenario(name: str) -> Scenario:
    """Read and check a scenario.

    Args:
        name: Name of a file in `scenarios/` without `.yaml`, or the path of another.

    Returns:
        The scenario; every task has an id of its own and as many goals as its type needs.

    Raises:
        InputError: There is no scenario of that name.
        hive_common.errors.FileError: The file has a mistake.
    """
    path = find_file("fleet_manager", "scenarios", name)
    content = read_checked(path, _SCHEMA)
    entries = content.pop("tasks")
    content.setdefault("map", content["world"])
    for key in ("world", "map", "fleet"):
        content[key] = beside(path, content[key])
    named = any(isinstance(goal, str) for entry in entries for goal in entry["goals"])
    places = places_of(content["world"]) if named else {}
    planned = [_planned(path, index, entry, places) for index, entry in enumerate(entries)]
    _check_ids(path, planned)
    planned.sort(key=lambda one: one.after)
    return Scenario(path=path, tasks=tuple(planned), **content)


def with_free_ids(scenario: Scenario, taken: Collection[str]) -> Scenario:
    """Return the scenario with ids that are not on a list yet, so that it can be run again.

    Args:
        scenario: As it was read.
        taken: The ids on the list.

    Returns:
        The same scenario if none of its ids is taken; else one whose ids all end in `-2`, or in
        the lowest number that makes every one of them free.
    """
    ids = [planned.task.id for planned in scenario.tasks]
    run, ending = 1, ""
    while any(f"{task_id}{ending}" in taken for task_id in ids):
        run += 1
        ending = f"-{run}"
    renamed = (
        replace(planned, task=replace(planned.task, id=f"{planned.task.id}{ending}"))
        for planned in scenario.tasks
    )
    return replace(scenario, tasks=tuple(renamed))


def _planned(
    path: Path, index: int, entry: dict[str, Any], places: Mapping[str, Pose]
) -> PlannedTask:
    """Return one task of the file, its places looked up."""
    kind = TaskType[entry["type"]]
    if len(entry["goals"]) < kind.goals_needed:
        problem = f"{len(entry['goals'])} given; {kind.name} needs at least {kind.goals_needed}"
        raise error_at(path, ("tasks", index, "goals"), problem)
    goals = []
    for number, goal in enumerate(entry["goals"]):
        if isinstance(goal, str) and goal not in places:
            known = ", ".join(sorted(places)) or "none"
            problem = f"no place '{goal}' in the world; there are: {known}"
            raise error_at(path, ("tasks", index, "goals", number), problem)
        goals.append(places[goal] if isinstance(goal, str) else Pose(*map(float, goal)))
    task = Task(
        id=entry["id"],
        type=kind,
        goals=tuple(goals),
        priority=entry.get("priority", 0),
        payload=float(entry.get("payload", 0.0)),
    )
    return PlannedTask(task, float(entry.get("after", 0.0)))


def _check_ids(path: Path, planned: list[PlannedTask]) -> None:
    """Refuse an id that two tasks have."""
    seen: dict[str, int] = {}
    for index, one in enumerate(planned):
        first = seen.setdefault(one.task.id, index)
        if first != index:
            problem = f"'{one.task.id}' is the id of tasks[{first}] already; choose another"
            raise error_at(path, ("tasks", index, "id"), problem)
