# SPDX-License-Identifier: BSD-3-Clause
"""A vehicle that speaks VDA 5050: takes orders, drives and works, and tells its state.

    vehicle = Vehicle(identity, drive, tools)
    vehicle.take(order)   # of topic `order`
    vehicle.step()        # ten times a second or so

`remote_control.py` lets it do instant actions, and `report.py` tells its state. It does not know
whether it is connected: cut off, it drives on to the end of its base.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from vda5050.protocol.state import ErrorLevel, OperatingMode
from vda5050.vehicle.action_queue import STANDING, ActionQueue
from vda5050.vehicle.instant_actions import InstantActions
from vda5050.vehicle.order_book import OrderBook
from vda5050.vehicle.order_rules import actions_of, impossible, malformed
from vda5050.vehicle.ports import Waypoint
from vda5050.vehicle.refusals import Cause, Refusal, about_order

if TYPE_CHECKING:
    from vda5050.protocol.factsheet import Factsheet
    from vda5050.protocol.order import Edge, Node, Order
    from vda5050.protocol.state import Error
    from vda5050.protocol.versions import Version
    from vda5050.vehicle.ports import Drive, Tools

_TAKES_ORDERS = {OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC, OperatingMode.INTERVENED}
_DRIVES = {OperatingMode.AUTOMATIC, OperatingMode.SEMIAUTOMATIC}
_KEEPS_PLACE = {*_TAKES_ORDERS, OperatingMode.MANUAL}
_DEVIATION = 0.3  # where an order names none: how far from a node the vehicle may pass [m]
_HEADING_DEVIATION = 0.1  # where an order names none [rad]
_ASK_BEFORE = 2.0  # a new base is asked for so long before the vehicle has to brake [s]


@attrs.frozen(kw_only=True)
class Identity:
    """What a vehicle is."""

    version: Version
    map_id: str
    """Of the map in which it knows its position."""
    factsheet: Factsheet


class Vehicle:
    """The state machine of a vehicle.

    Args:
        identity: What it is.
        drive: What moves it.
        tools: What else it can do.
    """

    def __init__(self, identity: Identity, drive: Drive, tools: Tools) -> None:
        self.identity = identity
        self.drive = drive
        self.tools = tools
        self.book = OrderBook(identity.version)
        self.actions = ActionQueue(tools)
        self.instant_actions = InstantActions()
        self.mode = OperatingMode.AUTOMATIC
        self.is_paused = False
        self.is_hibernating = False
        self.is_cancelling = False
        self.order_errors: tuple[Error, ...] = ()  # until a new order is taken
        self.instant_errors: tuple[Error, ...] = ()  # until a new instant action is taken
        self.own_errors: dict[str, Error] = {}  # by type, until they are gone
        self._way: tuple[Waypoint, ...] = ()

    @property
    def is_idle(self) -> bool:
        """Whether nothing of the order is left to do."""
        return not self.book.nodes and self.actions.is_done

    @property
    def wants_base(self) -> bool:
        """Whether the vehicle will soon have to brake because its base ends."""
        if not self.book.has_horizon or self.drive.pose is None:
            return False
        here, left = self.drive.pose[:2], 0.0
        for node in self.book.base:
            if node.node_position is not None:
                there = node.node_position.x, node.node_position.y
                left += ((there[0] - here[0]) ** 2 + (there[1] - here[1]) ** 2) ** 0.5
                here = there
        speed = abs(self.drive.velocity.vx)
        return left <= self.drive.braking_distance + _ASK_BEFORE * speed

    def take(self, order: Order) -> None:
        """Take an order or an update, or refuse it with an error of the standard."""
        if self.is_hibernating or self.book.is_repeated(order):
            return
        refusal = self._why_not(order)
        if refusal is not None:
            self.refuse(refusal, about_order(order))
            return
        is_new = order.order_id != self.book.order_id
        if is_new:
            self.actions.clear()
        self.book.take(order)
        self.order_errors = ()
        self.own_errors.pop(Cause.UNREACHABLE.name, None)
        for scope, action in actions_of(order):
            self.actions.expect([action], scope)
        left = (*(node.actions for node in self.book.nodes), *(e.actions for e in self.book.edges))
        self.actions.keep_only({action.action_id for each in left for action in each})
        if is_new:
            self._reach_next()

    def refuse(self, refusal: Refusal, about: tuple[tuple[str, str], ...]) -> None:
        """Tell of an order that was refused, until another one is taken."""
        self.order_errors = (refusal.error(self.identity.version, about),)

    def _why_not(self, order: Order) -> Refusal | None:
        wrong = malformed(order)
        if wrong is not None:
            return wrong
        if self.mode not in _TAKES_ORDERS:
            return Refusal(Cause.NOT_AVAILABLE, f"the operating mode is {self.mode.value}")
        if self.is_cancelling:
            return Refusal(Cause.OTHER_ORDER, f"order {self.book.order_id} is being cancelled")
        wrong = impossible(order, frozenset({self.identity.map_id}), self.tools)
        return wrong or self.book.why_not(order, self.drive.pose, is_idle=self.is_idle)

    def step(self) -> None:
        """Go on: take note of nodes that were reached, begin actions, drive."""
        reached = self.drive.passed
        if reached is not None and self._way:
            while self.book.base and self.book.nodes[0].sequence_id <= reached:
                self._reach_next()
        if self.is_cancelling and not self.drive.is_driving and not self.actions.is_working:
            self.book.clear()
            self.actions.cancel()
            self.is_cancelling = False
        entered = self.book.entered_edge
        if entered is not None:
            self.actions.trigger(entered.actions)
        self.actions.step(is_standing=not self.drive.is_driving, is_paused=not self._may_work)
        self.instant_actions.step()
        self._watch_drive()
        self._watch_limits()
        self._drive_on()

    @property
    def _may_work(self) -> bool:
        return not self.is_paused and self.mode in _DRIVES

    @property
    def _may_drive(self) -> bool:
        fatal = any(error.error_level is ErrorLevel.FATAL for error in self.own_errors.values())
        return self._may_work and not fatal and not self.is_cancelling and self.actions.lets_drive

    def _reach_next(self) -> None:
        left = self.book.edges[0] if self.book.edges else None
        node = self.book.reach()
        if left is not None and left.sequence_id < node.sequence_id:
            self.actions.leave_edge(left.actions)
        self.actions.trigger(node.actions)
        self._way = tuple(each for each in self._way if each.sequence > node.sequence_id)

    def _drive_on(self) -> None:
        way = self._next_way() if self._may_drive else ()
        if way == self._way:
            return
        self._way = way
        if way and self.drive.pose is not None:
            self.drive.go(self.book.last_place or self.drive.pose[:2], way)
        else:
            self.drive.halt()

    def _next_way(self) -> tuple[Waypoint, ...]:
        """Return the waypoints up to the next node where the vehicle has to stand."""
        way = []
        edges = {edge.sequence_id: edge for edge in self.book.edges}
        for node in self.book.base:
            way.append(_waypoint(node, edges.get(node.sequence_id - 1)))
            following = edges.get(node.sequence_id + 1)
            actions = (*node.actions, *(following.actions if following else ()))
            if any(action.blocking_type in STANDING for action in actions):
                break
        return tuple(way)

    def _watch_drive(self) -> None:
        """Tell of a node that the drive cannot get to."""
        key = Cause.UNREACHABLE.name
        if not self.drive.failure:
            self.own_errors.pop(key, None)
        elif key not in self.own_errors and self.book.nodes:
            about = (("nodeId", self.book.nodes[0].node_id), ("orderId", self.book.order_id))
            refusal = Refusal(Cause.UNREACHABLE, self.drive.failure)
            self.own_errors[key] = refusal.error(self.identity.version, about)

    def _watch_limits(self) -> None:
        """Tell of an edge that is driven otherwise than the order says."""
        key = Cause.NOT_HEEDED.name
        if not self.drive.unheeded or not self.book.edges:
            self.own_errors.pop(key, None)
        elif key not in self.own_errors:
            about = (("edgeId", self.book.edges[0].edge_id), ("orderId", self.book.order_id))
            refusal = Refusal(Cause.NOT_HEEDED, self.drive.unheeded)
            self.own_errors[key] = refusal.error(self.identity.version, about)

    def pause(self) -> None:
        """Stop driving, and pause the actions that can be paused."""
        self.is_paused = True
        self.actions.pause()

    def go_on(self) -> None:
        """Go on after a pause."""
        self.is_paused = False
        self.actions.resume()

    def cancel(self) -> None:
        """Drop the order: stop, end its actions, then be ready for another."""
        self.is_cancelling = True
        self.actions.cancel()
        self.drive.halt()
        self._way = ()

    def set_mode(self, mode: OperatingMode) -> None:
        """Change the operating mode, by hand; most modes clear the order."""
        if mode is self.mode:
            return
        self.mode = mode
        if mode not in _TAKES_ORDERS and not self.is_idle:
            self.cancel()
        if mode not in _KEEPS_PLACE:
            self.book.forget_place()


def _waypoint(node: Node, edge: Edge | None) -> Waypoint:
    """Return where the drive is to pass; nodes behind the first have a position."""
    where = node.node_position
    if where is None:
        raise ValueError(f"node {node.node_id} has no position; such orders are refused")
    allowed, turn = where.allowed_deviation_xy, where.allowed_deviation_theta
    return Waypoint(
        sequence=node.sequence_id,
        x=where.x,
        y=where.y,
        heading=where.theta,
        deviation=min(allowed.a, allowed.b) if allowed is not None else _DEVIATION,
        heading_deviation=turn if turn is not None else _HEADING_DEVIATION,
        max_speed=edge.maximum_speed if edge is not None else None,
    )
