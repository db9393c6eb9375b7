# SPDX-License-Identifier: BSD-3-Clause
"""Records, log entries and reports as JSON, the format of the journals."""

from __future__ import annotations

import json
from typing import Any

from blackboard.consensus.log import Entry
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState
from hive_common.pose import Pose


def to_json(value: TaskRecord | Entry | TaskUpdate) -> str:
    """Return a value as JSON."""
    return json.dumps(value, default=fields_of)


def fields_of(value: Any) -> dict[str, Any]:  # noqa: ANN401  (any dataclass)
    """Return the fields of a value by name, for `json.dumps`.

    `asdict` would copy nested values, and `fields` takes ten times as long. A Pose among the goals
    becomes an object; `json` would make it a list.
    """
    values = {name: getattr(value, name) for name in value.__dataclass_fields__}
    if "goals" in values:
        values["goals"] = [goal._asdict() for goal in values["goals"]]
    return values


def entry_from(text: str) -> Entry:
    """Return a log entry.

    Raises:
        ValueError: It is not JSON, or contains an unknown state.
        KeyError: A field is missing.
        TypeError: A field is unknown.
    """
    values = json.loads(text)
    records = tuple(map(_record, values["records"]))
    members = None if values["members"] is None else tuple(values["members"])
    forgotten = tuple(values.get("forgotten", ()))  # Journals of older versions lack it.
    return Entry(values["epoch"], values["version"], records, members, forgotten)


def record_from(text: str) -> TaskRecord:
    """Return a record; raises the same errors as `entry_from`."""
    return _record(json.loads(text))


def report_from(text: str) -> TaskUpdate:
    """Return a robot's report; raises the same errors as `entry_from`."""
    values = json.loads(text)
    return TaskUpdate(state=TaskState(values.pop("state")), **values)


def _record(values: dict[str, Any]) -> TaskRecord:
    task = values.pop("task")
    goals = tuple(Pose(**goal) for goal in task.pop("goals"))
    state = TaskState(values.pop("state"))
    others: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
    }
    return TaskRecord(Task(goals=goals, **task), state, **others)
