# SPDX-License-Identifier: BSD-3-Clause
"""Tells what a vehicle is, where it is and how it is doing, when the standard wants it told."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import attrs

from vda5050.protocol.state import (
    Connection,
    ConnectionState,
    EdgeState,
    EmergencyStop,
    MapOnBoard,
    NodeState,
    Position,
    SafetyState,
    Speed,
    State,
    Visualization,
)
from vda5050.protocol.topics import Topic
from vda5050.protocol.versions import Version

if TYPE_CHECKING:
    from collections.abc import Callable

    from vda5050.protocol.codec import Body
    from vda5050.vehicle.rates import Rates
    from vda5050.vehicle.vehicle import Vehicle


_ROUNDING = 1e-6  # a sum of periods may come out a little more than whole [s]


class Report:
    """Publishes a vehicle's state, visualization, connection and factsheet.

    Args:
        vehicle: The vehicle.
        rates: How often.
        publish: Sends a message on a topic; what is said of the connection is retained.
    """

    def __init__(
        self, vehicle: Vehicle, rates: Rates, publish: Callable[[Topic, Body], None]
    ) -> None:
        self._vehicle = vehicle
        self._rates = rates
        self._publish = publish
        self._told: State | None = None
        self._state_due = self._visualization_due = -math.inf
        self._hibernated = False
        self.emergency_stop = EmergencyStop.NONE

    def connected(self) -> None:
        """Tell everything: a broker was found, and it may know nothing."""
        self._publish(Topic.CONNECTION, Connection(self._connection))
        self.tell_factsheet()
        self._state_due = -math.inf

    @property
    def _connection(self) -> ConnectionState:
        hibernates = self._vehicle.is_hibernating
        return ConnectionState.HIBERNATING if hibernates else ConnectionState.ONLINE

    def tell_factsheet(self) -> None:
        """Publish what the vehicle is."""
        self._publish(Topic.FACTSHEET, self._vehicle.identity.factsheet)

    def tell_state(self) -> None:
        """Publish the state at the next step, changed or not."""
        self._state_due = -math.inf

    def step(self, now: float) -> None:
        """Publish what is due at a time [s]."""
        state = self.state()
        changed = self._told is None or _lasting(state) != _lasting(self._told)
        fell_asleep = self._vehicle.is_hibernating and not self._hibernated
        if now >= self._state_due - _ROUNDING or changed:
            if not self._hibernated:
                self._publish(Topic.STATE, state)
            self._told, self._state_due = state, now + self._rates.state_period
        if self._vehicle.is_hibernating is not self._hibernated:
            self._hibernated = fell_asleep
            self._publish(Topic.CONNECTION, Connection(self._connection))
        if now >= self._visualization_due - _ROUNDING and not self._hibernated:
            seen = Visualization(state.mobile_robot_position, state.velocity)
            self._publish(Topic.VISUALIZATION, seen)
            self._visualization_due = now + self._rates.visualization_period

    def state(self) -> State:
        """Return how the vehicle is now."""
        vehicle, book, velocity = self._vehicle, self._vehicle.book, self._vehicle.drive.velocity
        instant = vehicle.instant_actions.states
        apart = vehicle.identity.version is Version.V3_0
        return State(
            order_id=book.order_id,
            order_update_id=book.order_update_id,
            last_node_id=book.last_node_id,
            last_node_sequence_id=book.last_node_sequence_id,
            driving=vehicle.drive.is_driving,
            paused=vehicle.is_paused,
            new_base_request=vehicle.wants_base,
            operating_mode=vehicle.mode,
            node_states=tuple(
                NodeState(each.node_id, each.sequence_id, each.released, each.node_position)
                for each in book.nodes
            ),
            edge_states=tuple(
                EdgeState(each.edge_id, each.sequence_id, each.released) for each in book.edges
            ),
            action_states=vehicle.actions.states + (() if apart else instant),
            instant_action_states=instant if apart else (),
            power_supply=vehicle.tools.power_supply,
            loads=vehicle.tools.loads,
            errors=(
                *vehicle.own_errors.values(),
                *vehicle.order_errors,
                *vehicle.instant_errors,
            ),
            safety_state=SafetyState(self.emergency_stop, field_violation=False),
            mobile_robot_position=self._position(),
            velocity=Speed(velocity.vx, velocity.vy, velocity.wz),
            distance_since_last_node=self._distance(),
            maps=(MapOnBoard(vehicle.identity.map_id, "1", "ENABLED"),),
        )

    def _position(self) -> Position | None:
        pose = self._vehicle.drive.pose
        if pose is None:
            return None
        x, y, yaw = pose
        return Position(x, y, yaw, self._vehicle.identity.map_id, localized=True)

    def _distance(self) -> float | None:
        """Return how far the last node is behind, as the crow flies [m]."""
        pose, place = self._vehicle.drive.pose, self._vehicle.book.last_place
        return math.dist(pose[:2], place) if pose is not None and place is not None else None


def _lasting(state: State) -> State:
    """Return a state without what changes all the time."""
    charging = attrs.evolve(state.power_supply, state_of_charge=0.0, battery_voltage=None)
    return attrs.evolve(
        state,
        power_supply=charging,
        mobile_robot_position=None,
        velocity=None,
        distance_since_last_node=None,
    )
