# SPDX-License-Identifier: BSD-3-Clause
"""Reads scenarios: tasks that are posted to a hive at given times.

The files in `scenarios/` are the manual of the format. A goal is a pose, or the name of a station
or charger of the scenario's world.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import attrs

from blackboard.domain.task import MAX_PAYLOAD, Task, TaskType
from fleet_manager.config.places import places_of
from hive_common.checked_yaml import error_at, named_at, read_checked
from hive_common.pose import FARTHEST, Pose
from hive_common.resources import beside, find_file
from hive_common.structuring import Allowed, between, listed, one_of, positive

LATEST = 86400.0  # a task is posted within a day of the start of its scenario [s]
MAX_GOALS = 100  # as many goals as a hive accepts in one task


def _is_goal(goal: object) -> bool:
    """Return whether a goal is a name, or two or three numbers."""
    if not isinstance(goal, list):
        return isinstance(goal, str)
    numbers = [each for each in goal if type(each) in {int, float} and abs(each) <= FARTHEST]
    return len(goal) in {2, 3} and len(numbers) == len(goal)


@attrs.frozen(kw_only=True)
class _TaskEntry:
    """One task of a scenario file."""

    id: Annotated[
        str, Allowed("1..60 characters without spaces", re.compile(r"[!-~]{1,60}").fullmatch)
    ]
    type: Annotated[str, one_of(*(kind.name for kind in TaskType))]
    goals: Annotated[
        tuple[
            Annotated[
                Any,
                Allowed(
                    "[x, y] or [x, y, yaw] in the map frame [m, m, rad], each at most "
                    f"{FARTHEST:g}, or the name of a place",
                    _is_goal,
                ),
            ],
            ...,
        ],
        Allowed(f"a list of 1..{MAX_GOALS} goals", lambda goals: 1 <= len(goals) <= MAX_GOALS),
    ]
    priority: Annotated[int, between(0, 10, "a whole number")] = 0
    payload: Annotated[float, between(0, MAX_PAYLOAD, "a number of kg")] = 0.0
    split: bool = True
    """Whether the hive may split it if it is too heavy for every robot."""
    after: Annotated[float, between(0, LATEST, "a number of seconds")] = 0.0


@attrs.frozen(kw_only=True)
class _Head:
    """What a scenario file says besides its tasks."""

    description: str
    """What the scenario is for, in a sentence."""
    world: Annotated[str, Allowed("the name or path of a world")]
    fleet: Annotated[str, Allowed("the name or path of a fleet file")]
    """A fleet that can do the tasks."""
    map: Annotated[str, Allowed("the name or path of a map")] = ""
    """The map that the robots know; empty for that of the world."""
    time_limit: Annotated[float, positive("a number of seconds", 86400)] = 600.0
    """A task that is not done by then, on the hive's clock, counts as not done [s]."""


@attrs.frozen(kw_only=True)
class _Content(_Head):
    """What a scenario file holds."""

    tasks: Annotated[tuple[_TaskEntry, ...], listed("at least one task", 1)]


@dataclass(frozen=True)
class PlannedTask:
    """A task, and when it is posted."""

    task: Task
    after: float
    """From the start of the scenario, on the hive's clock [s]."""


@attrs.frozen(kw_only=True)
class Scenario(_Head):
    """A scenario that was read and checked."""

    path: Path
    tasks: tuple[PlannedTask, ...]
    """In the order in which they are posted."""

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.path.stem


def read_scenario(name: str) -> Scenario:
    """Read and check a scenario, given by its name in `scenarios/` without `.yaml` or by its path.

    Every task then has an id of its own and as many goals as its type needs.

    Raises:
        hive_common.errors.FileError: There is no such scenario, or its file has a mistake.
    """
    path = find_file("fleet_manager", "scenarios", name)
    content = read_checked(path, _Content)
    world = _found(path, "world", "simenv", content.world)
    named = any(isinstance(goal, str) for entry in content.tasks for goal in entry.goals)
    with named_at(path, "world"):
        places = places_of(world) if named else {}
    planned = [_planned(path, index, entry, places) for index, entry in enumerate(content.tasks)]
    _check_ids(path, planned)
    return Scenario(
        path=path,
        description=content.description,
        world=world,
        map=_found(path, "map", "simenv", content.map or content.world),
        fleet=_found(path, "fleet", "fleet_manager", content.fleet),
        time_limit=content.time_limit,
        tasks=tuple(sorted(planned, key=lambda one: one.after)),
    )


def _found(path: Path, key: str, package: str, name: str) -> str:
    """Return the name or the path that a key holds; refuse a name that is not known."""
    found = beside(path, name)
    with named_at(path, key):
        find_file(package, f"{key}s", found)
    return found


def with_free_ids(scenario: Scenario, taken: Collection[str]) -> Scenario:
    """Return the scenario with ids that no known task has, so that it can be run again.

    If an id is `taken`, all ids get the ending `-2`, or the lowest number that makes all free.
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
    return attrs.evolve(scenario, tasks=tuple(renamed))


def _planned(path: Path, index: int, entry: _TaskEntry, places: Mapping[str, Pose]) -> PlannedTask:
    """Return one task of the file, its places looked up."""
    kind = TaskType[entry.type]
    if len(entry.goals) < kind.goals_needed:
        problem = f"{len(entry.goals)} given; {kind.name} needs at least {kind.goals_needed}"
        raise error_at(path, ("tasks", index, "goals"), problem)
    goals = []
    for number, goal in enumerate(entry.goals):
        if isinstance(goal, str) and goal not in places:
            known = ", ".join(sorted(places)) or "none"
            problem = f"no place '{goal}' in the world; there are: {known}"
            raise error_at(path, ("tasks", index, "goals", number), problem)
        goals.append(places[goal] if isinstance(goal, str) else Pose(*map(float, goal)))
    task = Task(
        id=entry.id,
        type=kind,
        goals=tuple(goals),
        priority=entry.priority,
        payload=entry.payload,
        no_split=not entry.split,
    )
    return PlannedTask(task, entry.after)


def _check_ids(path: Path, planned: list[PlannedTask]) -> None:
    """Refuse an id that two tasks have."""
    seen: dict[str, int] = {}
    for index, one in enumerate(planned):
        first = seen.setdefault(one.task.id, index)
        if first != index:
            problem = f"'{one.task.id}' is already the id of tasks[{first}]; choose another"
            raise error_at(path, ("tasks", index, "id"), problem)
