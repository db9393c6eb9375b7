# SPDX-License-Identifier: BSD-3-Clause
"""How robots' claims on chargers travel over ROS, and where a fleet's chargers are read from."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import rospy
from std_msgs.msg import Header

import blackboard.msg as bb_msgs
from blackboard.domain import talker as topics
from blackboard.domain.settings import ChargingSettings
from blackboard.errors import SettingsError
from blackboard.robot.charger_claims import Claim
from blackboard.robot.charging import ChargingPlan
from blackboard.ros import params
from blackboard.ros.codec.records import pose_from_msg, pose_to_msg
from blackboard.ros.codec.wire import Wire
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Mapping


def _claim_to_msg(claim: Claim) -> bb_msgs.ChargerClaim:
    return bb_msgs.ChargerClaim(
        header=Header(stamp=rospy.Time.now(), frame_id="map"),
        robot_id=claim.robot_id,
        charger=claim.charger,
        since=claim.since,
        pose=pose_to_msg(claim.pose),
        conceded=[name for name, _ in claim.conceded],
        conceded_since=[since for _, since in claim.conceded],
    )


def _claim_from_msg(msg: bb_msgs.ChargerClaim) -> Claim:
    conceded = tuple(zip(msg.conceded, msg.conceded_since, strict=True))
    return Claim(msg.robot_id, msg.charger, msg.since, pose_from_msg(msg.pose), conceded)


CHARGER_WIRES: Mapping[str, Wire] = MappingProxyType(
    {topics.CHARGER_CLAIM: Wire(bb_msgs.ChargerClaim, _claim_to_msg, _claim_from_msg)}
)
"""How the messages about chargers are made and read."""


def read_charging_plan(hive: str) -> ChargingPlan:
    """Read where a hive's robots charge, and when, from the parameters under `charging`.

    Args:
        hive: The hive's namespace, with a slash at its end.

    Raises:
        SettingsError: A value is not allowed; the text names it.
    """
    name = f"{hive}charging/chargers"
    chargers = rospy.get_param(name, [])
    try:
        places = {str(entry["name"]): _pose(entry["pose"]) for entry in chargers}
    except (KeyError, TypeError, ValueError) as error:
        raise SettingsError(
            f"{name} cannot be used ({error}); allowed: a list of chargers, each with a name and "
            "a pose [x, y, yaw] in the map frame [m, m, rad]"
        ) from None
    return ChargingPlan(places, params.read(ChargingSettings, f"{hive}charging"))


def _pose(numbers: Any) -> Pose:  # noqa: ANN401  (what a parameter holds)
    x, y, yaw = map(float, numbers)
    return Pose(x, y, yaw)
