# SPDX-License-Identifier: BSD-3-Clause
"""Topics `state`, `visualization` and `connection`: what an AGV tells about itself."""

import enum
from typing import Annotated

import attrs

from vda5050.protocol.actions import ActionState
from vda5050.protocol.order import NodePosition, Trajectory
from vda5050.protocol.rules import Angle, NotNegative, Percent, Rule, Share, Text, UInt32, each


class OperatingMode(enum.Enum):
    """Who is in control of an AGV."""

    STARTUP = "STARTUP"
    AUTOMATIC = "AUTOMATIC"
    """The master is."""
    SEMIAUTOMATIC = "SEMIAUTOMATIC"
    """The master is, but a person sets the speed."""
    INTERVENED = "INTERVENED"
    MANUAL = "MANUAL"
    """A person is."""
    SERVICE = "SERVICE"
    TEACH_IN = "TEACH_IN"


class ErrorLevel(enum.Enum):
    """How bad an error is."""

    WARNING = "WARNING"
    """The AGV goes on."""
    URGENT = "URGENT"
    """The AGV goes on, but needs somebody soon; since 3.0."""
    CRITICAL = "CRITICAL"
    """The AGV cannot go on with what it does; since 3.0."""
    FATAL = "FATAL"
    """The AGV cannot go on; a person must help."""


class EmergencyStop(enum.Enum):
    """Whether an emergency stop is active, and who must acknowledge it."""

    AUTOACK = "AUTOACK"
    MANUAL = "MANUAL"
    REMOTE = "REMOTE"
    NONE = "NONE"


class ConnectionState(enum.Enum):
    """Whether an AGV is connected to the broker."""

    ONLINE = "ONLINE"
    OFFLINE = "OFFLINE"
    """It has said goodbye."""
    HIBERNATING = "HIBERNATING"
    """It is connected, but sends no state; since 3.0."""
    CONNECTION_BROKEN = "CONNECTION_BROKEN"
    """The broker has lost it."""


@attrs.frozen
class NodeState:
    """A node of the order that the AGV has still to reach."""

    node_id: Annotated[str, Text]
    sequence_id: Annotated[int, UInt32]
    released: bool
    node_position: NodePosition | None = None
    node_descriptor: str | None = None


@attrs.frozen
class EdgeState:
    """An edge of the order that the AGV has still to drive over."""

    edge_id: Annotated[str, Text]
    sequence_id: Annotated[int, UInt32]
    released: bool
    trajectory: Trajectory | None = None
    edge_descriptor: str | None = None


@attrs.frozen
class Position:
    """Where an AGV is."""

    x: float
    """[m], frame of the AGV's map."""
    y: float
    """[m], frame of the AGV's map."""
    theta: Annotated[float, Angle]
    """[rad], frame of the AGV's map."""
    map_id: Annotated[str, Text]
    localized: bool
    """Whether the position can be trusted."""
    localization_score: Annotated[float, Share] | None = None
    deviation_range: Annotated[float, NotNegative] | None = None
    """[m]."""
    map_description: str | None = None


@attrs.frozen
class Speed:
    """How fast an AGV drives, in its own frame."""

    vx: float | None = None
    """[m/s]."""
    vy: float | None = None
    """[m/s]."""
    omega: float | None = None
    """[rad/s]."""


@attrs.frozen
class Load:
    """A load on board."""

    load_id: str | None = None
    load_type: str | None = None
    load_position: str | None = None
    weight: Annotated[float, NotNegative] | None = None
    """[kg]."""


@attrs.frozen
class PowerSupply:
    """The battery."""

    state_of_charge: Annotated[float, Percent]
    """[%]."""
    charging: bool
    battery_voltage: float | None = None
    """[V]."""
    battery_current: float | None = None
    """[A]."""
    battery_health: Annotated[float, Percent] | None = None
    """[%]."""
    range: Annotated[float, NotNegative] | None = None
    """What the charge is enough for [m]."""


@attrs.frozen
class Reference:
    """What an error is about: the kind of thing, and its id."""

    reference_key: Annotated[str, Text]
    reference_value: str


@attrs.frozen
class Error:
    """Something that is wrong."""

    error_type: Annotated[str, Text]
    error_level: ErrorLevel
    error_references: tuple[Reference, ...] | None = None
    error_description: str | None = None
    error_hint: str | None = None

    def about(self, key: str) -> str | None:
        """Return the id of the thing of a kind that the error is about."""
        found = (r.reference_value for r in self.error_references or () if r.reference_key == key)
        return next(found, None)


@attrs.frozen
class InfoReference:
    """What an information is about."""

    reference_key: Annotated[str, Text]
    reference_value: str


@attrs.frozen
class Info:
    """Something for people to look at; nothing must depend on it."""

    info_type: Annotated[str, Text]
    info_level: Annotated[str, Rule(enum=["INFO", "DEBUG"])]
    info_references: tuple[InfoReference, ...] | None = None
    info_descriptor: str | None = None


@attrs.frozen
class SafetyState:
    """What stops an AGV for safety."""

    active_emergency_stop: EmergencyStop
    field_violation: bool


@attrs.frozen
class MapOnBoard:
    """A map that the AGV has."""

    map_id: Annotated[str, Text]
    map_version: str
    map_status: Annotated[str, Rule(enum=["ENABLED", "DISABLED"])]
    map_descriptor: str | None = None


@attrs.frozen(kw_only=True)
class State:
    """Topic `state`: all about an AGV, on every change and at least every 30 s."""

    order_id: Annotated[str, Rule(maxLength=256)]
    """Empty before the first order."""
    order_update_id: Annotated[int, UInt32]
    last_node_id: str
    """The last node reached; empty before the first."""
    last_node_sequence_id: Annotated[int, UInt32]
    driving: bool
    operating_mode: OperatingMode
    power_supply: PowerSupply
    safety_state: SafetyState
    node_states: tuple[NodeState, ...] = each()
    edge_states: tuple[EdgeState, ...] = each()
    action_states: tuple[ActionState, ...] = each()
    """Up to 2.1 also those of instant actions."""
    instant_action_states: tuple[ActionState, ...] = each()
    errors: tuple[Error, ...] = each()
    mobile_robot_position: Position | None = None
    velocity: Speed | None = None
    loads: tuple[Load, ...] | None = None
    """None: the AGV does not know what it carries."""
    paused: bool | None = None
    new_base_request: bool | None = None
    distance_since_last_node: Annotated[float, NotNegative] | None = None
    """[m]."""
    information: tuple[Info, ...] | None = None
    maps: tuple[MapOnBoard, ...] | None = None
    zone_set_id: str | None = None

    def action(self, action_id: str) -> ActionState | None:
        """Return how far an action is, or None if the AGV does not know it."""
        known = (*self.action_states, *self.instant_action_states)
        return next((each for each in known if each.action_id == action_id), None)


@attrs.frozen
class Visualization:
    """Topic `visualization`: where an AGV is, oftener than `state` says it."""

    mobile_robot_position: Position | None = None
    velocity: Speed | None = None


@attrs.frozen
class Connection:
    """Topic `connection`, latched; CONNECTION_BROKEN is the AGV's last will."""

    connection_state: ConnectionState
