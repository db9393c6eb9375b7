# SPDX-License-Identifier: BSD-3-Clause
"""The order of one AGV: what was sent, what the AGV shows of it, and what is to be sent next.

An AGV has one order at a time. Its base only grows, by updates that begin at its last released
node; anything else needs `cancelOrder` first. An update is sent when the AGV has shown the one
before in its state, and again if it does not show it.

Source: VDA 5050, chapters "Order", "Order update" and "Order cancellation (by fleet control)".
"""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING

from vda5050.agent.order_parts import order_of
from vda5050.protocol.actions import (
    CANCEL_ORDER,
    Action,
    ActionStatus,
    BlockingType,
    InstantActions,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from vda5050.agent.order_parts import Stop
    from vda5050.protocol.codec import Body
    from vda5050.protocol.order import Order
    from vda5050.protocol.state import Error, State

RESEND = 2.0
"""An order that the AGV has not shown by then is sent again [s]."""

SENDINGS = 4
"""How often a message is sent before its order is given up."""

MISSED = 3
"""An AGV that shows in so many states in a row that it has dropped an order has dropped it: one
state may be older than what it answers."""


REMEMBERED = 100  # orders that an AGV may still show

INSTANT = "instant-"
"""Begins the ids of instant actions, which versions before 3.0 list among those of the order."""


class Phase(Enum):
    """What there is between the hive and an AGV."""

    IDLE = auto()  # no order
    ACTIVE = auto()  # an order that was or will be sent
    CANCELLING = auto()  # an order that the AGV is to drop


class OrderKeeper:
    """The order of one AGV.

    Args:
        send: Sends a message to the AGV; returns whether there was a broker.
        name: Begins the ids of orders and instant actions; no other process has the same.

    Attributes:
        phase: What there is between the hive and the AGV.
        failure: Why the last order ended before its time; empty if it did not.
        completed: Whether the AGV has done all of the last order.
        stops: The nodes of the order, those it has reached included.
        released: How many of them belong to the base.
        reached: The index of the last one that the AGV has reached.
    """

    def __init__(self, send: Callable[[Body], bool], name: str) -> None:
        self.phase = Phase.IDLE
        self.failure = ""
        self.completed = False
        self.stops: list[Stop] = []
        self.released = self.reached = 0
        self.order_id = ""
        self._send = send
        self._name = name
        self._number = 0
        self._message: Order | None = None  # the last one sent
        self._update = self._echoed = -1
        self._sent_at = 0.0
        self._sendings = self._missing = 0
        self._first = 0  # the index of the first node of the last message
        self._dirty = False
        self._cancel_id = ""
        self._state: State | None = None
        self._sent: dict[str, int] = {}  # the last update of the latest orders

    @property
    def foreign(self) -> bool:
        """Whether the AGV works on an order that is not this one."""
        state = self._state
        return state is not None and state.order_id != self.order_id and is_at_work(state)

    def is_strange(self, order_id: str) -> bool:
        """Return whether an order was not given by this process."""
        return not order_id.startswith(f"{self._name}-")

    def knows(self, order_id: str, update: int) -> bool:
        """Return whether an AGV can have an update of an order: others' orders, and those sent."""
        return self.is_strange(order_id) or update <= self._sent.get(order_id, -1)

    @property
    def instant_id(self) -> str:
        """A new id for an instant action, which belongs to no order."""
        return f"{INSTANT}{self.next_id()}"

    @property
    def is_shown(self) -> bool:
        """Whether the AGV has shown the last message in its state."""
        return self._echoed == self._update >= 0

    def next_id(self) -> str:
        """Return an id that nothing else has."""
        self._number += 1
        return f"{self._name}-{self._number}"

    def begin(self, stops: Sequence[Stop], released: int, now: float) -> None:
        """Give the AGV an order; the one before must have ended.

        Args:
            stops: The nodes; the first is where the AGV is.
            released: How many of them are released.
            now: The time [s].
        """
        assert self.phase is Phase.IDLE  # noqa: S101  (an AGV has one order)
        self.phase, self.failure, self.completed = Phase.ACTIVE, "", False
        self.order_id = self.next_id()
        self.stops, self.released, self.reached = list(stops), released, 0
        self._message, self._update, self._echoed = None, -1, -1
        self._dirty = True
        self.pass_time(now)

    def extend(self, base: Sequence[Stop], horizon: Sequence[Stop], now: float) -> None:
        """Release more nodes behind the base, and replace the horizon.

        A horizon that only changes its course is told with the next base.
        """
        ends = not horizon and self.released < len(self.stops)
        self.stops = [*self.stops[: self.released], *base, *horizon]
        self.released += len(base)
        self._dirty = self._dirty or bool(base) or ends
        self.pass_time(now)

    def cancel(self, now: float) -> None:
        """Have the AGV drop its order, whoever gave it."""
        if self.phase is Phase.CANCELLING:
            return
        sent = self.phase is Phase.ACTIVE and self._message is not None
        if not sent and not self.foreign:
            self.phase = Phase.IDLE
            return
        self.phase, self._cancel_id = Phase.CANCELLING, ""
        self._sendings = 0
        self._ask_to_cancel(now)

    def pass_time(self, now: float) -> None:
        """Send what is due at a time [s]."""
        if self.phase is Phase.CANCELLING:
            if now - self._sent_at > RESEND:
                self._ask_to_cancel(now)
        elif self.phase is Phase.ACTIVE and not self.is_shown and self._message is not None:
            if now - self._sent_at > RESEND:
                self._send_again(now)
        elif self.phase is Phase.ACTIVE and self._dirty:
            self._send_next(now)

    def hear(self, state: State, now: float) -> None:
        """Take in what the AGV tells."""
        self._state = state
        if self.phase is Phase.CANCELLING:
            self._hear_cancelling(state)
        elif self.phase is Phase.ACTIVE and self._message is not None:
            self._hear_active(state, now)
        self.pass_time(now)

    def _hear_active(self, state: State, now: float) -> None:
        if state.order_id == self.order_id:
            # What this process never sent, the AGV cannot have.
            self._echoed = min(max(self._echoed, state.order_update_id), self._update)
            self._note_reached(state)
        rejection = None if self.is_shown else self._rejection(state)
        if rejection is not None:
            self.failure = f"it refuses the order: {_words(rejection)}"
            if self._echoed >= 0 or self.foreign:  # it still has what came before
                self.cancel(now)
            else:
                self.phase = Phase.IDLE
        elif self._echoed >= 0 and self._is_dropped(state):
            self._missing += 1
            if self._missing >= MISSED:
                self.failure, self.phase = "it has dropped its order", Phase.IDLE
        else:
            self._missing = 0
            if self.is_shown and not self._dirty:
                self._complete(state)

    def _note_reached(self, state: State) -> None:
        index = state.last_node_sequence_id // 2
        if self.reached < index < self.released:
            self.reached = index

    def _complete(self, state: State) -> None:
        whole = self.released == len(self.stops)
        if not whole or state.order_id != self.order_id or is_at_work(state) or state.driving:
            return
        states = (state.action(each.action_id) for stop in self.stops for each in stop.actions)
        failed = [
            each for each in states if each and each.action_status is not ActionStatus.FINISHED
        ]
        self.completed, self.phase = not failed, Phase.IDLE
        if failed:
            what = failed[0].action_type or failed[0].action_id
            self.failure = f"its action {what} failed: {failed[0].action_result or 'no reason'}"

    def _is_dropped(self, state: State) -> bool:
        """Return whether the AGV does not know the order any more, or the rest of it."""
        if state.order_id != self.order_id:
            return True
        assert self._message is not None  # noqa: S101  (the caller has looked)
        waits = self.is_shown and not self._message.nodes[-1].released
        return waits and not state.node_states and not state.driving

    def _rejection(self, state: State) -> Error | None:
        for error in state.errors:
            update = error.about("orderUpdateId")
            if error.about("orderId") == self.order_id and update in {None, str(self._update)}:
                return error
        return None

    def _hear_cancelling(self, state: State) -> None:
        answer = state.action(self._cancel_id)
        shown = self._echoed >= 0 or self._message is None
        gone = shown and not is_at_work(state)
        if (gone or (answer is not None and answer.action_status.ended)) and not state.driving:
            self.phase, self._message = Phase.IDLE, None

    def _ask_to_cancel(self, now: float) -> None:
        self._cancel_id = self.instant_id
        action = Action(CANCEL_ORDER, self._cancel_id, BlockingType.NONE)
        self._send(InstantActions((action,)))
        self._sent_at = now

    def _send_again(self, now: float) -> None:
        assert self._message is not None  # noqa: S101  (the caller has looked)
        if self._sendings >= SENDINGS:
            self.failure = f"it did not take over the order, sent {SENDINGS} times"
            self.cancel(now)
            return
        self._sent_at = now
        if self._send(self._message):
            self._sendings += 1

    def _send_next(self, now: float) -> None:
        first = 0
        if self._message is not None:
            first = self._first + len(self._message.base) - 1
        self._first, self._update = first, self._update + 1
        self._message = order_of(self.order_id, self._update, self.stops, self.released, first)
        self._dirty, self._sent_at, self._sendings = False, now, 0
        self._missing = 0
        self._sent[self.order_id] = self._update
        while len(self._sent) > REMEMBERED:
            del self._sent[next(iter(self._sent))]
        if self._send(self._message):
            self._sendings = 1


def is_at_work(state: State) -> bool:
    """Return whether an AGV has something of an order still to do."""
    open_actions = any(
        not each.action_status.ended and not each.action_id.startswith(INSTANT)
        for each in state.action_states
    )
    return bool(state.node_states or state.edge_states or open_actions)


def _words(error: Error) -> str:
    return ": ".join(filter(None, [error.error_type, error.error_description]))
