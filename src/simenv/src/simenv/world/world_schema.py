# SPDX-License-Identifier: BSD-3-Clause
"""What a world file may hold, as a JSON schema for `hive_common.checked_yaml`."""

from __future__ import annotations

from typing import Any

from hive_common.schema_parts import NAME, listed, numbers, positive, section

LARGEST = 500.0
"""The longest building that is taken in [m]; a longer one is most likely given in mm."""

_POINT = numbers(2, LARGEST, "a point [x, y] [m]")
_POSE = numbers(3, LARGEST, "[x, y, yaw] [m, m, rad]")
_HEIGHT = positive("how high it is drawn [m]", 50.0)
_FORMS = {
    "box": numbers(4, LARGEST, "[x_min, y_min, x_max, y_max] [m]"),
    "polygon": {
        "type": "array",
        "minItems": 3,
        "items": _POINT,
        "description": "at least 3 corners [x, y] in order [m]",
    },
    "circle": section({"centre": _POINT, "radius": positive("a radius [m]", LARGEST)}),
    "segment": section(
        {"from": _POINT, "to": _POINT, "thickness": positive("a thickness [m]", 10.0)}
    ),
}


def _shape(more: dict[str, Any]) -> dict[str, Any]:
    """Return the rule for a name, exactly one form, and perhaps what else there is of it."""
    return {
        "type": "object",
        "properties": {"name": NAME, **_FORMS, **more},
        "required": ["name"],
        "oneOf": [{"required": [form]} for form in _FORMS],
        "additionalProperties": False,
        "description": f"a name and exactly one of {', '.join(_FORMS)}; also {', '.join(more)}",
    }


_SHAPE = _shape({"height": _HEIGHT})
_DOOR = _shape({"height": _HEIGHT, "open": {"type": "boolean", "description": "true or false"}})
_STATION = section(
    {"name": NAME, "pose": _POSE},
    {
        "item": NAME,
        "stock": {"type": "integer", "minimum": 0, "description": "a whole number, at least 0"},
        "duration": positive("the time one pick takes [s]", 3600.0),
    },
)
_PLACE = section({"name": NAME, "pose": _POSE})
_PERSON = section(
    {"name": NAME, "route": listed(_POINT, "at least 2 points [x, y] [m]", least=2)},
    {"speed": positive("walking speed [m/s]", 5.0), "radius": positive("a radius [m]", 2.0)},
)

SOLID_KINDS = ("walls", "benches", "racks")
"""The lists of a world file that hold what robots bump into."""

PLACE_KINDS = ("chargers", "parking", "starts")
"""The lists of a world file that hold nothing but places with names."""

SCHEMA: dict[str, Any] = section(
    {
        "name": NAME,
        "size": {
            "type": "array",
            "minItems": 2,
            "maxItems": 2,
            "items": positive("a length [m]", LARGEST),
            "description": "[width, depth] of the building [m]",
        },
        "walls": listed(_SHAPE, "shapes"),
    },
    {
        "benches": listed(_SHAPE, "shapes"),
        "racks": listed(_SHAPE, "shapes"),
        "doors": listed(_DOOR, "doors"),
        "stations": listed(_STATION, "stations"),
        **{kind: listed(_PLACE, "places") for kind in PLACE_KINDS},
        "people": listed(_PERSON, "people"),
    },
)
