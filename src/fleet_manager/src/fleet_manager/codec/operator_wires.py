# SPDX-License-Identifier: BSD-3-Clause
"""The messages of operators' programs: the hive's, and those of the traffic planner."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import robot_description.msg as messages

from blackboard.codec.tables import WIRES, Wire
from fleet_manager.client.topics import TRAFFIC_STATE, ZONE_COMMAND
from fleet_manager.client.traffic import Lock, RobotWait, SlowPlace, TrafficState, ZoneCommand

if TYPE_CHECKING:
    from collections.abc import Mapping


def state_from_msg(msg: messages.TrafficState) -> TrafficState:
    """Return what the traffic planner tells."""
    return TrafficState(
        epoch=msg.epoch,
        time=msg.header.stamp.to_sec(),
        robots=tuple(msg.robots),
        zones=tuple(msg.zones),
        closed=tuple(msg.closed),
        waits=tuple(
            RobotWait(
                each.robot, each.waits_for, each.place.x, each.place.y, each.since, each.where
            )
            for each in msg.waits
        ),
        slowest=tuple(
            SlowPlace(each.place.x, each.place.y, each.waited, each.waits, each.where, each.delay)
            for each in msg.slowest
        ),
        locks=tuple(
            Lock(each.kind, tuple(each.robots), each.since, each.text) for each in msg.locks
        ),
        counts={
            messages.TrafficLock.CIRCLE: msg.deadlocks,
            messages.TrafficLock.BLOCKED: msg.blocked,
            messages.TrafficLock.OVERTAKEN: msg.overtaken,
            messages.TrafficLock.HELD: msg.held,
        },
        unreached={each.robot: tuple(each.places) for each in msg.unreached},
        status=msg.status,
    )


def command_to_msg(command: ZoneCommand) -> messages.ZoneCommand:
    """Return a command as a message."""
    return messages.ZoneCommand(command.zone, command.closed)


OPERATOR_WIRES: Mapping[str, Wire] = MappingProxyType(
    {
        **WIRES,
        TRAFFIC_STATE: Wire(
            messages.TrafficState, lambda state: state, state_from_msg, latched=True
        ),
        ZONE_COMMAND: Wire(messages.ZoneCommand, command_to_msg, lambda msg: msg),
    }
)
"""The messages of each topic that operators' programs use."""
