# SPDX-License-Identifier: BSD-3-Clause
"""What an AGV is: its factsheet as a robot model, with what a model file says in its place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import attrs

from vda5050.protocol.actions import DROP, PICK

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robot_description.models import RobotModel
    from vda5050.protocol.factsheet import Factsheet

_SCANNERS = 30.0
"""How far ahead an AGV's own scanners, which the hive does not know, let it drive [m]."""

_HOLONOMIC = "OMNI"

_ASSUMED: dict[str, Any] = {
    "kind": "agv",
    "source": "factsheet",
    "base": {
        "height": 0.3,
        "mass": 200.0,
        "max_yaw_rate": 1.0,
        "yaw_acceleration": 1.0,
        "friction_coefficient": 0.02,
    },
    "battery": {
        "capacity": 40.0,
        "voltage_full": 27.0,
        "voltage_empty": 22.0,
        "charging_time": 7200.0,
        "idle_power": 50.0,
    },
    "laser": {
        "beams": 360,
        "range_min": 0.05,
        "range_max": _SCANNERS,
        "field_of_view": 6.2832,
        "rate": 10.0,
        "pose": [0.0, 0.0, 0.0],
    },
    "interfaces": ["vda5050"],
    "communication": ["wifi"],
    "sensors": [],
}
"""What a factsheet does not say; a model file should."""

_ARM = {"reach": 1.0, "repeatability": 0.01, "power": 200.0}


def model_of(factsheet: Factsheet | None, file: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a robot model.

    Args:
        factsheet: What the AGV says of itself; None if it says nothing.
        file: A model file, whole or in part; what it says counts.
    """
    told = {} if factsheet is None else _told(factsheet)
    return _over(_over(_ASSUMED, told), file)


def with_own_scanners(model: RobotModel) -> RobotModel:
    """Return a robot model for navigation: no laser that the hive knows of limits an AGV."""
    return attrs.evolve(model, laser=attrs.evolve(model.laser, range_max=_SCANNERS))


def _told(sheet: Factsheet) -> dict[str, Any]:
    kind, size = sheet.type_specification, sheet.physical_parameters
    x, y = size.length / 2, size.width / 2
    base: dict[str, Any] = {
        "drive": "differential",
        "footprint": [[x, -y], [x, y], [-x, y], [-x, -y]],
        "max_speed": size.maximum_speed,
        "acceleration": min(
            size.maximum_acceleration, size.maximum_deceleration or size.maximum_acceleration
        ),
    }
    if kind.mobile_robot_kinematics == _HOLONOMIC:
        base |= {"drive": "holonomic", "max_speed_diagonal": size.maximum_speed}
    if size.maximum_height:
        base["height"] = size.maximum_height
    if size.maximum_angular_speed:
        base["max_yaw_rate"] = size.maximum_angular_speed
    told: dict[str, Any] = {
        "name": "agv",
        "maker": kind.series_name,
        "base": base,
        "payload": kind.maximum_load_mass,
        "capabilities": ["GA", "GAB"],
    }
    if sheet.can(PICK) and sheet.can(DROP):
        told["capabilities"] += ["GPA", "GPAB"]
        told["arm"] = _load_handling(sheet)
        told["kind"] = "mobile_manipulator"  # what the hive calls a robot that picks
    return told


def _load_handling(sheet: Factsheet) -> dict[str, Any]:
    """Return the device that picks and drops, with the slowest times that the factsheet names."""
    loads = sheet.load_specification
    sets = () if loads is None else loads.load_sets or ()
    pick = max((each.pick_time for each in sets if each.pick_time), default=10.0)
    drop = max((each.drop_time for each in sets if each.drop_time), default=10.0)
    payload = sheet.type_specification.maximum_load_mass
    return _ARM | {"payload": payload, "pick_duration": pick, "place_duration": drop}


def _over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Return a mapping with another one put over it, part by part."""
    merged = dict(below)
    for key, value in above.items():
        part = merged.get(key)
        if isinstance(part, dict) and isinstance(value, dict):
            merged[key] = _over(part, value)
        else:
            merged[key] = value
    return merged
