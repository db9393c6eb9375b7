# SPDX-License-Identifier: BSD-3-Clause
"""Topic `factsheet`: what an AGV is, as its maker says. Only what the hive can use is read."""

import enum
from typing import Annotated

import attrs

from vda5050.protocol.rules import NotNegative, Text, each


class ActionScope(enum.Enum):
    """Where an action may stand."""

    INSTANT = "INSTANT"
    NODE = "NODE"
    EDGE = "EDGE"
    ZONE = "ZONE"


@attrs.frozen(kw_only=True)
class TypeSpecification:
    """What kind of AGV it is."""

    series_name: Annotated[str, Text]
    mobile_robot_kinematics: Annotated[str, Text]
    """DIFF, OMNI, THREEWHEEL or the maker's word."""
    mobile_robot_class: Annotated[str, Text]
    """FORKLIFT, CONVEYOR, TUGGER, CARRIER or the maker's word."""
    maximum_load_mass: Annotated[float, NotNegative]
    """[kg]."""
    localization_types: tuple[str, ...] = each()
    navigation_types: tuple[str, ...] = each()
    series_description: str | None = None


@attrs.frozen(kw_only=True)
class PhysicalParameters:
    """How large and how fast an AGV is."""

    maximum_speed: Annotated[float, NotNegative]
    """[m/s]."""
    maximum_acceleration: Annotated[float, NotNegative]
    """[m/s^2]."""
    width: Annotated[float, NotNegative]
    """[m]."""
    length: Annotated[float, NotNegative]
    """[m]."""
    minimum_speed: Annotated[float, NotNegative] | None = None
    """[m/s]."""
    maximum_deceleration: Annotated[float, NotNegative] | None = None
    """[m/s^2]."""
    maximum_angular_speed: Annotated[float, NotNegative] | None = None
    """[rad/s]; since 3.0."""
    minimum_height: Annotated[float, NotNegative] | None = None
    """[m]."""
    maximum_height: Annotated[float, NotNegative] | None = None
    """[m]."""


@attrs.frozen
class RobotAction:
    """An action that an AGV can do."""

    action_type: Annotated[str, Text]
    action_scopes: tuple[ActionScope, ...] = each()
    action_descriptor: str | None = None


@attrs.frozen
class ProtocolFeatures:
    """What of the standard an AGV can do."""

    mobile_robot_actions: tuple[RobotAction, ...] = each()


@attrs.frozen(kw_only=True)
class LoadSet:
    """A kind of load that an AGV can carry."""

    set_name: str
    load_type: str
    maximum_weight: Annotated[float, NotNegative] | None = None
    """[kg]."""
    pick_time: Annotated[float, NotNegative] | None = None
    """[s]."""
    drop_time: Annotated[float, NotNegative] | None = None
    """[s]."""


@attrs.frozen
class LoadSpecification:
    """What an AGV can carry."""

    load_positions: tuple[str, ...] | None = None
    load_sets: tuple[LoadSet, ...] | None = None


@attrs.frozen(kw_only=True)
class Factsheet:
    """What an AGV is."""

    type_specification: TypeSpecification
    physical_parameters: PhysicalParameters
    protocol_features: ProtocolFeatures | None = None
    load_specification: LoadSpecification | None = None

    def can(self, action_type: str) -> bool | None:
        """Return whether the AGV names an action; None if it names none at all."""
        if self.protocol_features is None:
            return None
        return any(
            each.action_type == action_type for each in self.protocol_features.mobile_robot_actions
        )
