# SPDX-License-Identifier: BSD-3-Clause
"""Puts orders together from the stops of an AGV."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from vda5050.protocol.order import Edge, Node, Order

if TYPE_CHECKING:
    from collections.abc import Sequence

    from vda5050.protocol.actions import Action
    from vda5050.protocol.order import NodePosition


@attrs.frozen
class Stop:
    """A node of an order that is being put together."""

    position: NodePosition
    actions: tuple[Action, ...] = ()


def order_of(
    order_id: str, update: int, stops: Sequence[Stop], released: int, first: int
) -> Order:
    """Return an order or an update of it.

    Args:
        order_id: Its id.
        update: Which update it is.
        stops: All nodes of the order, from its beginning.
        released: How many of them belong to the base.
        first: The index of the first one that is sent.
    """
    nodes = tuple(
        Node(
            node_id=_node_id(order_id, index),
            sequence_id=2 * index,
            released=index < released,
            actions=stop.actions,
            node_position=stop.position,
        )
        for index, stop in enumerate(stops)
        if index >= first
    )
    edges = tuple(
        Edge(
            edge_id=f"{_node_id(order_id, index - 1)}-{_node_id(order_id, index)}",
            sequence_id=2 * index - 1,
            released=index < released,
            start_node_id=_node_id(order_id, index - 1),
            end_node_id=_node_id(order_id, index),
        )
        for index in range(first + 1, len(stops))
    )
    return Order(order_id, update, nodes, edges)


def _node_id(order_id: str, index: int) -> str:
    return f"{order_id}.{index}"
