# SPDX-License-Identifier: BSD-3-Clause
"""An AGV is given one order at a time, and what it does not show is sent again."""

import attrs
import pytest

from vda5050.agent.order_keeper import MISSED, RESEND, SENDINGS, OrderKeeper, Phase
from vda5050.agent.order_parts import Stop
from vda5050.protocol.order import NodePosition, Order
from vda5050.protocol.state import (
    EmergencyStop,
    Error,
    ErrorLevel,
    NodeState,
    OperatingMode,
    PowerSupply,
    Reference,
    SafetyState,
    State,
)

IDLE = State(
    order_id="",
    order_update_id=0,
    last_node_id="",
    last_node_sequence_id=0,
    driving=False,
    operating_mode=OperatingMode.AUTOMATIC,
    power_supply=PowerSupply(90.0, charging=False),
    safety_state=SafetyState(EmergencyStop.NONE, field_violation=False),
)


def stops(*xs):
    return [Stop(NodePosition(float(x), 0.0, "hall")) for x in xs]


class Desk:
    """A keeper, what it sends, and an AGV that shows what the test says."""

    def __init__(self):
        self.sent, self.now = [], 0.0
        self.keeper = OrderKeeper(lambda body: bool(self.sent.append(body)) or True, "p1")

    @property
    def orders(self):
        return [body for body in self.sent if isinstance(body, Order)]

    @property
    def cancels(self):
        return [body for body in self.sent if not isinstance(body, Order)]

    def wait(self, seconds):
        self.now += seconds
        self.keeper.pass_time(self.now)

    def show(self, *, reached=0, left=(), **others):
        """Show the last order in the AGV's state."""
        order = self.orders[-1]
        nodes = tuple(NodeState(each.node_id, each.sequence_id, each.released) for each in left)
        state = attrs.evolve(
            IDLE,
            order_id=order.order_id,
            order_update_id=order.order_update_id,
            last_node_sequence_id=2 * reached,
            node_states=nodes,
            **others,
        )
        self.keeper.hear(state, self.now)
        return state


@pytest.fixture
def desk():
    desk = Desk()
    desk.keeper.begin(stops(0, 1, 2, 3), 3, desk.now)
    return desk


def test_an_order_has_a_base_and_a_horizon(desk):
    [order] = desk.orders
    assert [node.released for node in order.nodes] == [True, True, True, False]
    assert [node.sequence_id for node in order.nodes] == [0, 2, 4, 6]
    assert [edge.sequence_id for edge in order.edges] == [1, 3, 5]
    assert [edge.released for edge in order.edges] == [True, True, False]


def test_an_update_begins_at_the_last_released_node_once_the_order_is_shown(desk):
    desk.keeper.extend(stops(3), stops(4), desk.now)
    assert len(desk.orders) == 1

    desk.show(left=desk.orders[0].nodes[1:])
    assert len(desk.orders) == 2
    update = desk.orders[1]
    assert (update.order_id, update.order_update_id) == (desk.orders[0].order_id, 1)
    assert update.nodes[0].node_id == desk.orders[0].nodes[2].node_id
    assert [node.sequence_id for node in update.nodes] == [4, 6, 8]


def test_an_order_that_is_not_shown_is_sent_again_and_then_given_up(desk):
    for _ in range(SENDINGS - 1):
        desk.wait(RESEND + 0.1)
    assert len(desk.orders) == SENDINGS
    assert len(set(desk.orders)) == 1

    desk.wait(RESEND + 0.1)
    assert "did not take over the order" in desk.keeper.failure
    assert len(desk.orders) == SENDINGS
    assert len(desk.cancels) == 1


def test_an_order_that_is_refused_fails_with_what_the_agv_says(desk):
    order = desk.orders[0]
    about = (Reference("orderId", order.order_id), Reference("orderUpdateId", "0"))
    error = Error("noRouteError", ErrorLevel.WARNING, about, "too far")
    desk.keeper.hear(attrs.evolve(IDLE, errors=(error,)), desk.now)

    assert desk.keeper.failure == "it refuses the order: noRouteError: too far"
    assert desk.keeper.phase is Phase.IDLE


def test_an_order_is_done_when_all_of_it_was_driven(desk):
    desk.keeper.extend(stops(3), (), desk.now)
    desk.show(left=desk.orders[0].nodes[1:])
    desk.show(reached=2, left=desk.orders[1].nodes[1:], driving=True)
    assert not desk.keeper.completed
    desk.show(reached=3)

    assert desk.keeper.completed
    assert desk.keeper.phase is Phase.IDLE


def test_an_agv_that_drops_its_order_is_believed_when_it_says_so_again(desk):
    desk.show(left=desk.orders[0].nodes[1:])
    for number in range(MISSED):
        assert desk.keeper.phase is Phase.ACTIVE, number
        desk.keeper.hear(IDLE, desk.now)

    assert desk.keeper.failure == "it has dropped its order"


def test_no_new_order_goes_out_before_the_cancelled_one_is_gone(desk):
    working = desk.show(left=desk.orders[0].nodes[1:], driving=True)
    desk.keeper.cancel(desk.now)
    desk.keeper.hear(working, desk.now)
    assert desk.keeper.phase is Phase.CANCELLING
    desk.wait(RESEND + 0.1)
    assert len(desk.cancels) == 2  # it may have got lost

    desk.keeper.hear(attrs.evolve(working, node_states=(), driving=True), desk.now)
    assert desk.keeper.phase is Phase.CANCELLING
    desk.keeper.hear(attrs.evolve(working, node_states=(), driving=False), desk.now)
    assert desk.keeper.phase is Phase.IDLE


def test_what_an_earlier_agent_has_left_can_be_cancelled():
    desk = Desk()
    node = NodeState("x.1", 2, released=True)
    foreign = attrs.evolve(IDLE, order_id="old-1", node_states=(node,), driving=True)
    desk.keeper.hear(foreign, desk.now)
    assert desk.keeper.foreign

    desk.keeper.cancel(desk.now)
    assert len(desk.cancels) == 1
    desk.keeper.hear(attrs.evolve(foreign, node_states=(), driving=False), desk.now)
    assert desk.keeper.phase is Phase.IDLE
