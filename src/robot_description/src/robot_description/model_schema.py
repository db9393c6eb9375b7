# SPDX-License-Identifier: BSD-3-Clause
"""What a robot model file may hold, as a JSON schema for `checked_yaml.read_checked`."""

from __future__ import annotations

from typing import Any


def _positive(what: str, most: float) -> dict[str, Any]:
    """Return the rule for a number above 0, up to `most`; `what` names it with its unit."""
    return {
        "type": "number",
        "exclusiveMinimum": 0,
        "maximum": most,
        "description": f"{what}, above 0 and at most {most:g}",
    }


def _section(needed: dict[str, Any], optional: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the rule for a mapping with exactly these keys."""
    return {
        "type": "object",
        "properties": needed | (optional or {}),
        "required": list(needed),
        "additionalProperties": False,
        "description": "the keys " + ", ".join(needed | (optional or {})),
    }


_TEXT = {"type": "string", "minLength": 1, "description": "a text that is not empty"}
_NAMES = {"type": "array", "items": _TEXT, "uniqueItems": True, "description": "a list of names"}
_COORDINATE = {
    "type": "number",
    "minimum": -5,
    "maximum": 5,
    "description": "a coordinate in base_footprint [m], from -5 to 5",
}
_DRIVE = {
    "enum": ["differential", "holonomic"],
    "description": "differential or holonomic",
}
_FOOTPRINT = {
    "type": "array",
    "minItems": 3,
    "items": {
        "type": "array",
        "minItems": 2,
        "maxItems": 2,
        "items": _COORDINATE,
        "description": "a corner [x, y] in base_footprint [m]",
    },
    "description": "at least 3 corners [x, y] of a convex polygon, counter-clockwise [m]",
}
_POSE = {
    "type": "array",
    "minItems": 3,
    "maxItems": 3,
    "items": {"type": "number", "minimum": -6.2832, "maximum": 6.2832},
    "description": "[x, y, yaw] in base_footprint [m, m, rad]",
}

BASE = _section(
    {
        "drive": _DRIVE,
        "footprint": _FOOTPRINT,
        "height": _positive("height of the base [m]", 3),
        "mass": _positive("mass without load [kg]", 5000),
        "max_speed": _positive("top speed [m/s]", 5),
        "max_yaw_rate": _positive("top turning speed [rad/s]", 10),
        "acceleration": _positive("acceleration [m/s^2]", 5),
        "yaw_acceleration": _positive("turning acceleration [rad/s^2]", 20),
        "friction_coefficient": _positive("rolling friction [-]", 1),
    },
    {"max_speed_diagonal": _positive("top speed along a diagonal [m/s]", 5)},
)

BATTERY = _section(
    {
        "capacity": _positive("capacity [Ah]", 1000),
        "voltage_full": _positive("voltage at full charge [V]", 500),
        "voltage_empty": _positive("voltage when empty [V]", 500),
        "charging_time": _positive("time from empty to full [s]", 86400),
        "idle_power": _positive("power drawn standing still [W]", 2000),
    }
)

LASER = _section(
    {
        "beams": {
            "type": "integer",
            "minimum": 8,
            "maximum": 10000,
            "description": "number of beams, from 8 to 10000",
        },
        "range_min": _positive("closest distance measured [m]", 5),
        "range_max": _positive("farthest distance measured [m]", 100),
        "field_of_view": _positive("field of view [rad]", 6.2832),
        "rate": _positive("scans per second [Hz]", 100),
        "pose": _POSE,
    }
)

ARM = _section(
    {
        "payload": _positive("what the arm lifts [kg]", 1000),
        "reach": _positive("reach [m]", 5),
        "repeatability": _positive("repeatability [m]", 0.1),
        "pick_duration": _positive("time for a pick [s]", 600),
        "place_duration": _positive("time for putting down [s]", 600),
        "power": _positive("power drawn while moving [W]", 5000),
    }
)

SCHEMA = _section(
    {
        "name": {
            "type": "string",
            "pattern": "^[a-z][a-z0-9_]*$",
            "description": "a name of small letters, digits and _, such as mir100",
        },
        "maker": _TEXT,
        "source": _TEXT,
        "base": BASE,
        "payload": _positive("what the robot carries [kg]", 5000),
        "battery": BATTERY,
        "laser": LASER,
        "capabilities": {
            "type": "array",
            "minItems": 1,
            "uniqueItems": True,
            "items": {
                "enum": ["GA", "GAB", "GPA", "GPAB"],
                "description": "a task type: GA, GAB, GPA or GPAB",
            },
            "description": "a list of task types out of GA, GAB, GPA, GPAB",
        },
        "interfaces": _NAMES,
        "communication": _NAMES,
    },
    {"arm": ARM},
)
