# SPDX-License-Identifier: BSD-3-Clause
"""What a world file may hold, as a JSON schema for `robot_description.checked_yaml`."""

from __future__ import annotations

from typing import Any

LARGEST = 500.0
"""The longest building that is taken in [m]; a longer one is most likely given in mm."""


def _numbers(count: int, what: str) -> dict[str, Any]:
    """Return the rule for a list of `count` numbers; `what` names them with their units."""
    return {
        "type": "array",
        "minItems": count,
        "maxItems": count,
        "items": {
            "type": "number",
            "minimum": -LARGEST,
            "maximum": LARGEST,
            "description": f"a number from {-LARGEST:g} to {LARGEST:g}",
        },
        "description": what,
    }


def _positive(what: str, most: float) -> dict[str, Any]:
    return {
        "type": "number",
        "exclusiveMinimum": 0,
        "maximum": most,
        "description": f"{what}, above 0 and at most {most:g}",
    }


def _section(needed: dict[str, Any], optional: dict[str, Any] | None = None) -> dict[str, Any]:
    return {
        "type": "object",
        "properties": needed | (optional or {}),
        "required": list(needed),
        "additionalProperties": False,
        "description": "the keys " + ", ".join(needed | (optional or {})),
    }


def _list(items: dict[str, Any], what: str) -> dict[str, Any]:
    return {"type": "array", "items": items, "description": f"a list of {what}"}


_NAME = {"type": "string", "minLength": 1, "description": "a name that is not empty"}
_POINT = _numbers(2, "a point [x, y] [m]")
_POSE = _numbers(3, "[x, y, yaw] [m, m, rad]")
_FORMS = {
    "box": _numbers(4, "[x_min, y_min, x_max, y_max] [m]"),
    "polygon": {
        "type": "array",
        "minItems": 3,
        "items": _POINT,
        "description": "at least 3 corners [x, y] in order [m]",
    },
    "circle": _section({"centre": _POINT, "radius": _positive("a radius [m]", LARGEST)}),
    "segment": _section(
        {"from": _POINT, "to": _POINT, "thickness": _positive("a thickness [m]", 10.0)}
    ),
}
_SHAPE = {
    "type": "object",
    "properties": {"name": _NAME, **_FORMS},
    "required": ["name"],
    "minProperties": 2,
    "maxProperties": 2,
    "additionalProperties": False,
    "description": "a name and exactly one of " + ", ".join(_FORMS),
}
_STATION = _section(
    {"name": _NAME, "pose": _POSE},
    {
        "item": _NAME,
        "stock": {"type": "integer", "minimum": 0, "description": "a whole number, at least 0"},
        "duration": _positive("the time one pick takes [s]", 3600.0),
    },
)
_PLACE = _section({"name": _NAME, "pose": _POSE})

SOLID_KINDS = ("walls", "benches", "racks")
"""The lists of a world file that hold what robots bump into."""

SCHEMA: dict[str, Any] = _section(
    {
        "name": _NAME,
        "size": {
            "type": "array",
            "minItems": 2,
            "maxItems": 2,
            "items": _positive("a length [m]", LARGEST),
            "description": "[width, depth] of the building [m]",
        },
        "walls": _list(_SHAPE, "shapes"),
    },
    {
        "benches": _list(_SHAPE, "shapes"),
        "racks": _list(_SHAPE, "shapes"),
        "stations": _list(_STATION, "stations"),
        "chargers": _list(_PLACE, "places"),
        "starts": _list(_PLACE, "places"),
    },
)
