# SPDX-License-Identifier: BSD-3-Clause
"""Looks up the places that a world names, so that an operator can write `dock` for a pose."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hive_common.checked_yaml import read_checked
from hive_common.pose import Pose
from hive_common.resources import find_file

if TYPE_CHECKING:
    from collections.abc import Mapping

_PLACES = {
    "type": "array",
    "items": {
        "type": "object",
        "required": ["name", "pose"],
        "properties": {
            "name": {"type": "string"},
            "pose": {
                "type": "array",
                "minItems": 3,
                "maxItems": 3,
                "items": {"type": "number"},
                "description": "[x, y, yaw] in the map frame [m, m, rad]",
            },
        },
    },
}
_SCHEMA: dict[str, Any] = {
    "type": "object",
    "properties": {"stations": _PLACES, "chargers": _PLACES},
}
"""Only what is looked at here; the world's own reader checks the rest."""


def places_of(world: str) -> Mapping[str, Pose]:
    """Return the stations and chargers of a world by name.

    Args:
        world: Name of a file in simenv's `worlds/` without `.yaml`, or the path of another.

    Returns:
        The pose in the map frame in which a robot stands at each place.

    Raises:
        InputError: There is no world of that name.
        hive_common.errors.FileError: The file has a mistake.
    """
    content = read_checked(find_file("simenv", "worlds", world), _SCHEMA)
    entries = content.get("stations", []) + content.get("chargers", [])
    return {entry["name"]: Pose(*map(float, entry["pose"])) for entry in entries}
