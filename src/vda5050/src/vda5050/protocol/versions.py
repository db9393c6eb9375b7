# SPDX-License-Identifier: BSD-3-Clause
"""The versions of the standard, and all that differs between their messages.

Source: the field tables of VDA 5050, chapter "Protocol specification", versions 2.0, 2.1, 3.0.
"""

from __future__ import annotations

import enum
import re


class Version(enum.Enum):
    """A version of the standard that can be spoken."""

    V2_0 = "2.0"
    V2_1 = "2.1"
    V3_0 = "3.0"

    @property
    def text(self) -> str:
        """The version as it stands in headers."""
        return f"{self.value}.0"

    @property
    def interface(self) -> str:
        """The first part of topics that the standard proposes."""
        return "vda5050" if self is Version.V3_0 else "uagv"

    @property
    def major(self) -> str:
        """The second part of topics."""
        return f"v{self.value[0]}"


def _earlier(name: str | None) -> dict[Version, str | None]:
    """Return what both versions before 3.0 call a field or value; None if they lack it."""
    return {Version.V2_0: name, Version.V2_1: name}


NAMES: dict[str, dict[Version, str | None]] = {
    "Action.action_descriptor": _earlier("actionDescription"),
    "Action.retriable": _earlier(None),
    "ActionState.action_descriptor": _earlier("actionDescription"),
    "ActionState.action_result": _earlier("resultDescription"),
    "Corridor.corridor_reference_point": _earlier("corridorRefPoint"),
    "Corridor.release_required": _earlier(None),
    "Corridor.release_loss_behavior": _earlier(None),
    "Edge.corridor": {Version.V2_0: None},
    "Edge.edge_descriptor": _earlier("edgeDescription"),
    "Edge.maximum_speed": _earlier("maxSpeed"),
    "Edge.maximum_mobile_robot_height": _earlier("maxHeight"),
    "Edge.minimum_load_handling_device_height": _earlier("minHeight"),
    "Edge.maximum_rotation_speed": _earlier("maxRotationSpeed"),
    "Edge.reach_orientation_before_entering": _earlier(None),
    "Edge.rotation_allowed": {Version.V3_0: None},
    "EdgeState.edge_descriptor": _earlier("edgeDescription"),
    "Error.error_hint": {Version.V2_0: None},
    "Info.info_descriptor": _earlier("infoDescription"),
    "LoadSet.maximum_weight": _earlier("maxWeight"),
    "Node.node_descriptor": _earlier("nodeDescription"),
    "NodePosition.allowed_deviation_xy": {
        Version.V2_0: "allowedDeviationXy",  # as in its schema; its text has XY
        Version.V2_1: "allowedDeviationXY",
        Version.V3_0: "allowedDeviationXY",
    },
    "NodePosition.map_description": {Version.V3_0: None},
    "NodeState.node_descriptor": _earlier("nodeDescription"),
    "Order.order_description": _earlier(None),
    "Order.zone_set_id": {Version.V3_0: None},
    "PhysicalParameters.maximum_acceleration": _earlier("accelerationMax"),
    "PhysicalParameters.maximum_angular_speed": _earlier(None),
    "PhysicalParameters.maximum_deceleration": _earlier("decelerationMax"),
    "PhysicalParameters.maximum_height": _earlier("heightMax"),
    "PhysicalParameters.maximum_speed": _earlier("speedMax"),
    "PhysicalParameters.minimum_height": _earlier("heightMin"),
    "PhysicalParameters.minimum_speed": _earlier("speedMin"),
    "Position.localized": _earlier("positionInitialized"),
    "Position.map_description": {Version.V3_0: None},
    "PowerSupply.battery_current": _earlier(None),
    "PowerSupply.range": _earlier("reach"),
    "PowerSupply.state_of_charge": _earlier("batteryCharge"),
    "ProtocolFeatures.mobile_robot_actions": _earlier("agvActions"),
    "RobotAction.action_descriptor": _earlier("actionDescription"),
    "SafetyState.active_emergency_stop": _earlier("eStop"),
    "State.instant_action_states": _earlier(None),
    "State.maps": {Version.V2_0: None},
    "State.mobile_robot_position": _earlier("agvPosition"),
    "State.power_supply": _earlier("batteryState"),
    "State.zone_set_id": {Version.V3_0: None},
    "TypeSpecification.maximum_load_mass": _earlier("maxLoadMass"),
    "TypeSpecification.mobile_robot_class": _earlier("agvClass"),
    "TypeSpecification.mobile_robot_kinematics": _earlier("agvKinematic"),
    "Visualization.mobile_robot_position": _earlier("agvPosition"),
}
"""What fields are called where that is not their Python name in camel case; None: no field."""

VALUES: dict[str, dict[Version, str | None]] = {
    "ActionStatus.RETRIABLE": _earlier("FAILED"),
    "BlockingType.SINGLE": _earlier("HARD"),
    "ConnectionState.CONNECTION_BROKEN": _earlier("CONNECTIONBROKEN"),
    "CorridorReferencePoint.KINEMATIC_CENTER": _earlier("KINEMATICCENTER"),
    "EmergencyStop.AUTOACK": {Version.V3_0: "MANUAL"},
    "ErrorLevel.CRITICAL": _earlier("WARNING"),
    "ErrorLevel.URGENT": _earlier("WARNING"),
    "OperatingMode.INTERVENED": _earlier("SERVICE"),
    "OperatingMode.STARTUP": _earlier("SERVICE"),
    "OperatingMode.TEACH_IN": _earlier("TEACHIN"),
}
"""How values are written where that is not their name; a version that lacks one has the nearest,
which is the more careful."""

HEADER_OPTIONAL: dict[str, tuple[Version, ...]] = {
    "visualization": (Version.V2_0, Version.V2_1),
    "factsheet": (Version.V2_0, Version.V2_1),
}
"""The messages whose header id and timestamp may be missing."""

CIRCLES = (Version.V2_0, Version.V2_1)
"""The versions in which a deviation is the radius of a circle, not an ellipse."""


def field_name(kind: str, field: str, version: Version) -> str | None:
    """Return what a version calls a field of a class; None if it has none."""
    return NAMES.get(f"{kind}.{field}", {}).get(version, _camel(field))


def value_name(value: enum.Enum, version: Version) -> str:
    """Return how a version writes a value."""
    key = f"{type(value).__name__}.{value.name}"
    return VALUES.get(key, {}).get(version) or str(value.value)


def _camel(name: str) -> str:
    return re.sub(r"_(\w)", lambda found: found[1].upper(), name)
