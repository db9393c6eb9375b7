# SPDX-License-Identifier: BSD-3-Clause
"""What makes an order impossible for a vehicle, whatever it does at the moment."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from vda5050.protocol.factsheet import ActionScope
from vda5050.vehicle.refusals import Cause, Refusal

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hive_common.pose import Pose
    from vda5050.protocol.actions import Action
    from vda5050.protocol.order import Edge, Node, Order
    from vda5050.vehicle.ports import Tools

START_WITHIN = 0.5
"""How far the first node may be away where the order names no deviation [m]."""


def malformed(order: Order) -> Refusal | None:
    """Return what is wrong with the chain of nodes and edges, or None."""
    problem = next(_broken_links(order), "")
    return Refusal(Cause.MALFORMED, problem) if problem else None


def _broken_links(order: Order) -> Iterator[str]:
    nodes, edges = order.nodes, order.edges
    if not order.order_id:
        yield "orderId is empty; an order needs an id"
    if not nodes or len(edges) != len(nodes) - 1:
        yield f"{len(nodes)} nodes and {len(edges)} edges; allowed: one edge less than nodes"
        return
    if not nodes[0].released:
        yield f"the first node {nodes[0].node_id} is not released"
    if nodes[0].sequence_id % 2:
        yield f"node {nodes[0].node_id} has an odd sequenceId, {nodes[0].sequence_id}"
    for start, edge, end in zip(nodes, edges, nodes[1:], strict=False):
        yield from _broken_link(start, edge, end)
    ids = [action.action_id for _, action in actions_of(order)]
    doubled = next((each for each in ids if ids.count(each) > 1), None)
    if doubled is not None:
        yield f"two actions have the id {doubled}"


def _broken_link(start: Node, edge: Edge, end: Node) -> Iterator[str]:
    numbers = (edge.sequence_id, end.sequence_id)
    wanted = (start.sequence_id + 1, start.sequence_id + 2)
    if numbers != wanted:
        yield f"edge {edge.edge_id} and its end have sequenceIds {numbers}; allowed: {wanted}"
    if (edge.start_node_id, edge.end_node_id) != (start.node_id, end.node_id):
        yield f"edge {edge.edge_id} does not connect {start.node_id} to {end.node_id}"
    if edge.released and not (start.released and end.released):
        yield f"edge {edge.edge_id} is released, but not both of its nodes"
    if end.released and not edge.released:
        yield f"node {end.node_id} is released behind edge {edge.edge_id}, which is not"


def actions_of(order: Order) -> Iterator[tuple[ActionScope, Action]]:
    """Yield every action of an order, and where it stands."""
    for node in order.nodes:
        yield from ((ActionScope.NODE, action) for action in node.actions)
    for edge in order.edges:
        yield from ((ActionScope.EDGE, action) for action in edge.actions)


def impossible(order: Order, map_ids: frozenset[str], tools: Tools) -> Refusal | None:
    """Return why the vehicle can never carry out a well-formed order, or None.

    Args:
        order: The order.
        map_ids: The maps that the vehicle knows.
        tools: What the vehicle can do besides driving.
    """
    for node in order.nodes:
        where = node.node_position
        about = (("nodeId", node.node_id),)
        if where is not None and where.map_id not in map_ids:
            known = ", ".join(sorted(map_ids))
            text = f"map {where.map_id} of node {node.node_id} is not known; known: {known}"
            return Refusal(Cause.UNKNOWN_MAP, text, (*about, ("mapId", where.map_id)))
        if where is None and node is not order.nodes[0]:
            text = f"node {node.node_id} has no nodePosition, and this vehicle knows no nodes"
            return Refusal(Cause.NO_ROUTE, text, about)
    for edge in order.edges:
        if edge.trajectory is not None:
            text = f"edge {edge.edge_id} has a trajectory; this vehicle drives straight edges"
            return Refusal(Cause.PARAMETER, text, (("edgeId", edge.edge_id), ("trajectory", "")))
    for scope, action in actions_of(order):
        why = tools.why_not(action, scope)
        if why:
            text = f"action {action.action_type}: {why}"
            which = (("actionId", action.action_id), ("actionType", action.action_type))
            return Refusal(Cause.ACTION, text, which)
    return None


def stands_on(node: Node, pose: Pose | None, last_node_id: str) -> bool:
    """Return whether the first node of an order is trivially reachable from `pose`, frame map."""
    where = node.node_position
    if where is None:
        return node.node_id == last_node_id
    if pose is None:
        return False
    return within(node, pose) or math.dist(pose[:2], (where.x, where.y)) <= START_WITHIN


def within(node: Node, pose: Pose) -> bool:
    """Return whether a pose is in the deviation that a node with a position allows."""
    where = node.node_position
    if where is None or where.allowed_deviation_xy is None:
        return False
    ellipse = where.allowed_deviation_xy
    dx, dy = pose.x - where.x, pose.y - where.y
    cos, sin = math.cos(ellipse.theta), math.sin(ellipse.theta)
    if min(ellipse.a, ellipse.b) <= 0:
        return False
    return math.hypot((cos * dx + sin * dy) / ellipse.a, (cos * dy - sin * dx) / ellipse.b) <= 1
