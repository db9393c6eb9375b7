# SPDX-License-Identifier: BSD-3-Clause
"""What a robot model file may hold, as a JSON schema for `checked_yaml.read_checked`."""

from __future__ import annotations

from hive_common.schema_parts import numbers, positive, section

_TEXT = {"type": "string", "minLength": 1, "description": "a text that is not empty"}
_NAMES = {"type": "array", "items": _TEXT, "uniqueItems": True, "description": "a list of names"}
KINDS = ("agv", "amr", "mobile_manipulator", "tracked", "legged")
"""What sort of robot a model is; for people, and for a fleet's choice of models."""

_KIND = {"enum": list(KINDS), "description": ", ".join(KINDS[:-1]) + f" or {KINDS[-1]}"}
_DRIVE = {
    "enum": ["differential", "holonomic"],
    "description": "differential or holonomic",
}
_FOOTPRINT = {
    "type": "array",
    "minItems": 3,
    "items": numbers(2, 5, "a corner [x, y] in base_footprint [m], each from -5 to 5"),
    "description": "at least 3 corners [x, y] of a convex polygon, counter-clockwise [m]",
}
_POSE = numbers(3, 6.2832, "[x, y, yaw] in base_footprint [m, m, rad]")

BASE = section(
    {
        "drive": _DRIVE,
        "footprint": _FOOTPRINT,
        "height": positive("height of the base [m]", 3),
        "mass": positive("mass without load [kg]", 5000),
        "max_speed": positive("top speed [m/s]", 5),
        "max_yaw_rate": positive("top turning speed [rad/s]", 10),
        "acceleration": positive("acceleration [m/s^2]", 5),
        "yaw_acceleration": positive("turning acceleration [rad/s^2]", 20),
        "friction_coefficient": positive("rolling friction [-]", 1),
    },
    {"max_speed_diagonal": positive("top speed along a diagonal [m/s]", 5)},
)

BATTERY = section(
    {
        "capacity": positive("capacity [Ah]", 1000),
        "voltage_full": positive("voltage at full charge [V]", 500),
        "voltage_empty": positive("voltage when empty [V]", 500),
        "charging_time": positive("time from empty to full [s]", 86400),
        "idle_power": positive("power drawn standing still [W]", 2000),
    }
)

LASER = section(
    {
        "beams": {
            "type": "integer",
            "minimum": 8,
            "maximum": 10000,
            "description": "number of beams, from 8 to 10000",
        },
        "range_min": positive("closest distance measured [m]", 5),
        "range_max": positive("farthest distance measured [m]", 100),
        "field_of_view": positive("field of view [rad]", 6.2832),
        "rate": positive("scans per second [Hz]", 100),
        "pose": _POSE,
    }
)

ARM = section(
    {
        "payload": positive("what the arm lifts [kg]", 1000),
        "reach": positive("reach [m]", 5),
        "repeatability": positive("repeatability [m]", 0.1),
        "pick_duration": positive("time for a pick [s]", 600),
        "place_duration": positive("time for putting down [s]", 600),
        "power": positive("power drawn while moving [W]", 5000),
    },
    {"accuracy": positive("accuracy [m]", 0.1)},
)

SCHEMA = section(
    {
        "name": {
            "type": "string",
            "pattern": "^[a-z][a-z0-9_]*$",
            "description": "a name of small letters, digits and _, such as mir100",
        },
        "kind": _KIND,
        "maker": _TEXT,
        "source": _TEXT,
        "base": BASE,
        "payload": positive("what the robot carries [kg]", 5000),
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
        "sensors": _NAMES,
    },
    {"arm": ARM},
)
