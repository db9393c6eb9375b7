# SPDX-License-Identifier: BSD-3-Clause
"""The table of robots: its columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fleet_manager.desk import formats
from fleet_manager.desk.natural import padded
from fleet_manager.desk.places import place_of
from fleet_manager.desk.words import text
from fleet_manager.gui.look import ROBOT_SIGNS, Tone
from fleet_manager.gui.rows_model import Column

if TYPE_CHECKING:
    from collections.abc import Callable

    from fleet_manager.desk.places import Place
    from fleet_manager.desk.rows import RobotRow

LOW = 0.2  # state of charge from which a person should mind; robots keep 0.1 for themselves
_LOW_TEXT = "100 % low"


def robot_columns(places: Callable[[], tuple[Place, ...]]) -> tuple[Column, ...]:
    """Return the columns of the robot table.

    Args:
        places: Gives the named places of the world; empty where none is known.
    """

    def place(row: RobotRow) -> str:
        pose = row.status.pose
        name = place_of(pose, places())
        return f"{name} ({formats.position(pose)})" if name else formats.position(pose)

    return (
        Column("column.robot", _name, lambda r: padded(r.status.robot_id), letters=8),
        Column("column.state", _state, lambda r: int(r.state), _tone, letters=10),
        Column("column.battery", _battery, _charge, _battery_tone, _charge, _LOW_TEXT, letters=14),
        Column("column.current", _current, lambda r: padded(r.status.task_id), letters=11),
        Column("column.queue", _queue, lambda r: len(_behind(r)), letters=11),
        Column("column.load", _load, lambda r: r.status.payload, to_right=True, letters=7),
        Column("column.place", place, place, letters=15),
        Column("column.reason", _reason, _reason, letters=14),
    )


def _name(row: RobotRow) -> str:
    return row.status.robot_id


def _reason(row: RobotRow) -> str:
    return row.status.reason


def _state(row: RobotRow) -> str:
    return f"{ROBOT_SIGNS[row.state][0]} {text(f'robot.{row.state.name}')}"


def _tone(row: RobotRow) -> Tone:
    return ROBOT_SIGNS[row.state][1]


def _charge(row: RobotRow) -> float:
    return row.status.charge


def _battery(row: RobotRow) -> str:
    key = "value.low" if row.status.charge < LOW else "value.charge"
    return text(key, charge=formats.percent(row.status.charge))


def _battery_tone(row: RobotRow) -> Tone | None:
    return Tone.BAD if row.status.charge < LOW else None


def _load(row: RobotRow) -> str:
    return formats.mass(row.status.payload)


def _current(row: RobotRow) -> str:
    return row.status.task_id or text("value.unknown")


def _queue(row: RobotRow) -> str:
    """Return how many tasks stand behind the current one, and which."""
    return f"{len(behind)}: {', '.join(behind)}" if (behind := _behind(row)) else "0"


def _behind(row: RobotRow) -> list[str]:
    return [name for name in row.status.tasks if name != row.status.task_id]
