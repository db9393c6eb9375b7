# SPDX-License-Identifier: BSD-3-Clause
"""The one order of a vehicle: how it comes in, grows, and is worked off.

The steps to accept an order are those of VDA 5050 3.0, figure 8 "The process of accepting an order
or order update"; versions before differ only in the types of errors.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vda5050.protocol.versions import Version
from vda5050.vehicle.order_rules import stands_on
from vda5050.vehicle.refusals import Cause, Refusal

if TYPE_CHECKING:
    from hive_common.pose import Pose
    from vda5050.protocol.order import Edge, Node, Order


class OrderBook:
    """What is left of the order; the first of `nodes` is the next node to reach."""

    def __init__(self, version: Version) -> None:
        self._version = version
        self._received: Order | None = None
        self.order_id = ""
        self.order_update_id = 0
        self.last_node_id = ""
        self.last_node_sequence_id = 0
        self.last_place: tuple[float, float] | None = None  # of the last node, frame map [m]
        self.nodes: list[Node] = []  # still to reach, in this order
        self.edges: list[Edge] = []  # still to drive over; edge i ends at node i
        self.is_cancelled = False
        self._decision: Node | None = None  # the last node of the base

    @property
    def base(self) -> list[Node]:
        """The released nodes that are still to reach."""
        return [node for node in self.nodes if node.released]

    @property
    def has_horizon(self) -> bool:
        """Whether the way goes on behind the base."""
        return any(not node.released for node in self.nodes)

    def why_not(self, order: Order, pose: Pose | None, *, is_idle: bool) -> Refusal | None:
        """Return why a well-formed, possible order cannot be taken now, or None.

        Args:
            order: The order or update.
            pose: Where the vehicle is, frame map.
            is_idle: Whether nothing of the order so far is left to do.
        """
        if order.order_id == self.order_id:
            return self._why_no_update(order)
        if not is_idle:
            text = f"order {self.order_id} is not finished; cancel it first"
            return Refusal(Cause.OTHER_ORDER, text)
        if order.order_update_id != 0 and self._version is Version.V3_0:
            text = f"a new order begins with orderUpdateId 0, not {order.order_update_id}"
            return Refusal(Cause.MALFORMED, text)
        if not stands_on(order.nodes[0], pose, self.last_node_id):
            where = pose if pose is not None else "an unknown place"
            text = f"the first node {order.nodes[0].node_id} is too far from {where}"
            return Refusal(Cause.START_TOO_FAR, text, (("nodeId", order.nodes[0].node_id),))
        return None

    def is_repeated(self, order: Order) -> bool:
        """Return whether an order says what the last one said: it is then ignored.

        Before 3.0 the ids alone decide.
        """
        same = order.order_id == self.order_id and order.order_update_id == self.order_update_id
        return same and (self._version is not Version.V3_0 or order == self._received)

    def _why_no_update(self, order: Order) -> Refusal | None:
        mine, its = self.order_update_id, order.order_update_id
        if its < mine:
            text = f"orderUpdateId {its} is below {mine}, the one that is carried out"
            return Refusal(Cause.OUTDATED, text)
        if its == mine:
            text = f"orderUpdateId {mine} came before with other content"
            return Refusal(Cause.SAME_UPDATE, text)
        if self.is_cancelled:
            text = f"order {self.order_id} was cancelled; give the rest a new orderId"
            return Refusal(Cause.AFTER_CANCEL, text)
        first, end = order.nodes[0], self._decision
        if end is None or (first.node_id, first.sequence_id) != (end.node_id, end.sequence_id):
            wanted = "no node" if end is None else f"{end.node_id} ({end.sequence_id})"
            text = f"the update begins at {first.node_id} ({first.sequence_id}), not at {wanted}"
            return Refusal(Cause.NO_CONTINUATION, text, (("nodeId", first.node_id),))
        return None

    def take(self, order: Order) -> None:
        """Take an order that `why_not` has nothing against, or add an update to its order."""
        if order.order_id == self.order_id:
            self.nodes = self.base + list(order.nodes[1:])
            self.edges = [edge for edge in self.edges if edge.released] + list(order.edges)
        else:
            self.nodes, self.edges = list(order.nodes), list(order.edges)
            self.order_id, self.is_cancelled = order.order_id, False
        self.order_update_id = order.order_update_id
        self._decision = order.base[-1]
        self._received = order

    @property
    def entered_edge(self) -> Edge | None:
        """The edge that the vehicle is on or may enter; None at the end of the base."""
        following = next(iter(self.edges), None)
        return following if following is not None and following.released else None

    def reach(self) -> Node:
        """Take note that the next node was reached, and return it."""
        node = self.nodes.pop(0)
        self.edges = [edge for edge in self.edges if edge.sequence_id > node.sequence_id]
        self.last_node_id, self.last_node_sequence_id = node.node_id, node.sequence_id
        where = node.node_position
        if where is not None:
            self.last_place = where.x, where.y
        return node

    def clear(self) -> None:
        """Drop what is left of the order; its ids stay, and no update will be taken."""
        self.nodes, self.edges = [], []
        self.is_cancelled = True

    def forget_place(self, node_id: str = "") -> None:
        """Take note that the vehicle was moved by others, to a node or to nowhere known."""
        self.last_node_id, self.last_node_sequence_id, self.last_place = node_id, 0, None
