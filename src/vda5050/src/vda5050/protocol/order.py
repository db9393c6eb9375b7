# SPDX-License-Identifier: BSD-3-Clause
"""Topic `order`: the nodes and edges that an AGV is to drive over, and what to do there.

The released part of an order is its base; what follows is its horizon, where the AGV must not
go yet. Nodes have even and edges odd sequence ids, counted through the whole order.
"""

import enum
from typing import Annotated

import attrs

from vda5050.protocol.actions import Action
from vda5050.protocol.rules import Angle, NotNegative, Rule, Text, UInt32, each


@attrs.frozen
class Deviation:
    """How far from a node an AGV may pass: an ellipse, up to 2.1 a circle."""

    a: Annotated[float, NotNegative]
    """Semi-major axis [m]."""
    b: Annotated[float, NotNegative]
    """Semi-minor axis [m]."""
    theta: float = 0.0
    """Of the major axis, frame map [rad]."""


@attrs.frozen
class NodePosition:
    """Where a node is."""

    x: float
    """[m], frame of the AGV's map."""
    y: float
    """[m], frame of the AGV's map."""
    map_id: Annotated[str, Text]
    theta: Annotated[float, Angle] | None = None
    """Heading to have on the node [rad]; None: any."""
    allowed_deviation_xy: Deviation | None = None
    allowed_deviation_theta: Annotated[float, Angle] | None = None
    """[rad], 0..pi."""
    map_description: str | None = None


@attrs.frozen
class Node:
    """A place to reach."""

    node_id: Annotated[str, Text]
    sequence_id: Annotated[int, UInt32]
    released: bool
    """Whether it belongs to the base."""
    actions: tuple[Action, ...] = each()
    node_position: NodePosition | None = None
    node_descriptor: str | None = None


@attrs.frozen
class ControlPoint:
    """A control point of a curve."""

    x: float
    """[m], frame of the AGV's map."""
    y: float
    """[m], frame of the AGV's map."""
    weight: Annotated[float, NotNegative] | None = None


@attrs.frozen
class Trajectory:
    """The course of an edge, a NURBS."""

    control_points: tuple[ControlPoint, ...]
    knot_vector: tuple[float, ...] | None = None
    degree: Annotated[int, Rule(minimum=1, maximum=100)] | None = None


class CorridorReferencePoint(enum.Enum):
    """What must stay inside a corridor."""

    KINEMATIC_CENTER = "KINEMATIC_CENTER"
    CONTOUR = "CONTOUR"


class OrientationType(enum.Enum):
    """What the orientation on an edge is measured from."""

    GLOBAL = "GLOBAL"
    """From the map."""
    TANGENTIAL = "TANGENTIAL"
    """From the edge."""


@attrs.frozen
class Corridor:
    """How far an AGV may leave its edge to drive around something."""

    left_width: Annotated[float, NotNegative]
    """[m]."""
    right_width: Annotated[float, NotNegative]
    """[m]."""
    corridor_reference_point: CorridorReferencePoint | None = None
    release_required: bool | None = None
    release_loss_behavior: Annotated[str, Rule(enum=["STOP", "RETURN"])] | None = None


@attrs.frozen
class Edge:
    """The way from one node to the next."""

    edge_id: Annotated[str, Text]
    sequence_id: Annotated[int, UInt32]
    released: bool
    """Whether it belongs to the base."""
    start_node_id: Annotated[str, Text]
    end_node_id: Annotated[str, Text]
    actions: tuple[Action, ...] = each()
    maximum_speed: Annotated[float, NotNegative] | None = None
    """[m/s]."""
    maximum_mobile_robot_height: Annotated[float, NotNegative] | None = None
    """[m]."""
    minimum_load_handling_device_height: Annotated[float, NotNegative] | None = None
    """[m]."""
    orientation: Annotated[float, Angle] | None = None
    """[rad]."""
    orientation_type: OrientationType | None = None
    direction: str | None = None
    rotation_allowed: bool | None = None
    reach_orientation_before_entering: bool | None = None
    maximum_rotation_speed: Annotated[float, NotNegative] | None = None
    """[rad/s]."""
    trajectory: Trajectory | None = None
    length: Annotated[float, NotNegative] | None = None
    """[m]."""
    corridor: Corridor | None = None
    edge_descriptor: str | None = None


@attrs.frozen
class Order:
    """What an AGV is to do: a way and the actions on it."""

    order_id: Annotated[str, Rule(maxLength=256)]
    order_update_id: Annotated[int, UInt32]
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    order_description: str | None = None
    zone_set_id: str | None = None

    @property
    def base(self) -> tuple[Node, ...]:
        """The nodes that are released."""
        return tuple(node for node in self.nodes if node.released)
