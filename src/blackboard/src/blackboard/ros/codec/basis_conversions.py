# SPDX-License-Identifier: BSD-3-Clause
"""What bids are worked out from, as a message."""

from __future__ import annotations

import blackboard.msg as bb_msgs
from blackboard.costing.bid_basis import BidBasis
from blackboard.domain.battery import BatteryModel
from blackboard.domain.characteristics import RobotCharacteristics
from blackboard.domain.task import TaskType
from blackboard.errors import CharacteristicsError
from blackboard.ros.codec.records import pose_from_msg, pose_to_msg

_BODY = (
    "mass",
    "payload",
    "max_speed",
    "friction_coefficient",
    "radius",
    "arm_payload",
    "arm_power",
    "pick_duration",
    "place_duration",
    "idle_power",
)
"""Fields of RobotCharacteristics that the message has by the same names."""


def basis_to_msg(basis: BidBasis) -> bb_msgs.BidBasis:
    """Return the message for what a robot is and has."""
    body, battery = basis.body, basis.body.battery
    return bb_msgs.BidBasis(
        pose=pose_to_msg(basis.pose),
        charge=basis.charge,
        at_work=basis.at_work,
        refusal=basis.refusal,
        tasks=[task_id for task_id, _ in basis.tasks],
        steps=bytes(step for _, step in basis.tasks),
        cost_model=basis.cost_model,
        aging=basis.aging,
        chargers=[pose_to_msg(place) for place in basis.chargers],
        pace=list(basis.pace),
        capabilities=bytes(sorted(body.capabilities)),
        battery_capacity=battery.capacity,
        voltage_full=battery.voltage_full,
        voltage_empty=battery.voltage_empty,
        charging_time=battery.charging_time,
        **{name: getattr(body, name) for name in _BODY},
    )


def basis_from_msg(msg: bb_msgs.BidBasis) -> BidBasis:
    """Read what a robot is and has.

    Raises:
        ValueError: It says that of itself what no robot can be; the text names it.
    """
    try:
        battery = BatteryModel(
            msg.battery_capacity, msg.voltage_full, msg.voltage_empty, msg.charging_time
        )
        body = RobotCharacteristics(
            battery=battery,
            capabilities=frozenset(map(TaskType, msg.capabilities)),
            **{name: getattr(msg, name) for name in _BODY},
        )
    except CharacteristicsError as error:
        raise ValueError(str(error)) from None
    return BidBasis(
        body,
        msg.cost_model,
        msg.aging,
        pose_from_msg(msg.pose),
        msg.charge,
        msg.at_work,
        msg.refusal,
        tuple(zip(msg.tasks, msg.steps, strict=True)),
        tuple(map(pose_from_msg, msg.chargers)),
        tuple(msg.pace),
    )
