# SPDX-License-Identifier: BSD-3-Clause
"""The robot node: one robot's part of the hive, and its member."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy

from blackboard.domain import talker as topics
from blackboard.domain.battery import Battery
from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.settings import (
    ChargingSettings,
    ControllerSettings,
    PathSettings,
    RobotSettings,
)
from blackboard.domain.task import StepKind
from blackboard.errors import SettingsError
from blackboard.robot.charging import ChargingPlan
from blackboard.robot.executor import Controller
from blackboard.robot.robot import Robot
from blackboard.ros import membership
from blackboard.ros.commands import MoveBaseCommand, PickCommand
from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.senses import Senses, wait_for_pose
from blackboard.ros.startup import run_node
from blackboard.ros.talker import RosTalker
from hive_common.pose import Pose
from hive_common.ros import params

if TYPE_CHECKING:
    from blackboard.robot.executor import Command

_ROBOT_TOPICS = (topics.TASK_COST, topics.CHARGER_CLAIM)


def main() -> None:
    """Run one robot's part of the hive until the node is shut down.

    The node runs in the robot's namespace; the namespace above it is the hive's. A robot that
    `stands_by` subscribes to and advertises everything that the blackboard node does as well.

    ROS Subscribers: `task_bc`, `task_assign`, `map`, `bb_backup`, `bb_entries` of the hive;
        `set_state`, `amcl_pose`, `odom`, `drop_charge` of the robot.
    ROS Publishers: `task_cost`, `task_state`, `robot_status`, `charger_claim`, `bb_ack` of the
        hive; `battery_state` of the robot; `/diagnostics`.
    ROS Actions: client of the robot's `move_base` and, if it has an arm, `pick`.
    ROS Parameters: `characteristics` of the robot and `charging` of the hive (its chargers and
        thresholds); for all others see config/robot.yaml.
    """
    run_node("robot", _run)


def _run() -> None:
    hive, robot_id = _hive_and_robot()
    kinds = (RobotSettings, ControllerSettings, PathSettings)
    params.refuse_unknown(kinds, ["charge", "journal", "stands_by"])
    settings, patience = params.read(RobotSettings), params.read(ControllerSettings)
    stands_by = params.flag("stands_by", default=True)
    body = characteristics_from(rospy.get_param("characteristics", {}))
    battery = Battery(body.battery, rospy.get_param("~charge", 1.0))

    journal = membership.open_journal()
    member_topics = membership.VOTER_TOPICS if stands_by else membership.LEARNER_TOPICS
    talker = RosTalker(hive, (*_ROBOT_TOPICS, *member_topics), latches=[topics.ROBOT_STATUS])
    path_lengths = RosPathLengths(talker, hive, params.read(PathSettings))
    commands: dict[StepKind, Command] = {
        StepKind.MOVE: MoveBaseCommand(talker, patience.server_timeout)
    }
    if any(kind.picks for kind in body.capabilities):
        pick = PickCommand(talker, patience.server_timeout)
        commands |= {StepKind.PICK: pick, StepKind.PLACE: pick}
    controller = Controller(commands, talker.world, patience)
    node = membership.join(talker, hive, path_lengths, journal, stands_by=stands_by)
    robot = Robot(
        talker,
        robot_id,
        body,
        battery,
        path_lengths.of(body.radius),
        controller,
        wait_for_pose(),
        settings,
        journal,
        node,
        _charging_plan(hive),
    )
    Senses(talker, robot, battery, settings.status_period).start()
    robot.start()
    node.start()
    talker.spin()


def _hive_and_robot() -> tuple[str, str]:
    """Return the hive's namespace, which ends in a slash, and the robot's name."""
    namespace = rospy.get_namespace()
    robot_id = namespace.strip("/").rpartition("/")[2]
    if not robot_id:
        raise SettingsError(
            "this node has to run in its robot's namespace, for example robot1; "
            "start it with roslaunch blackboard robot.launch name:=robot1"
        )
    return namespace[: -len(robot_id) - 1], robot_id


def _charging_plan(hive: str) -> ChargingPlan:
    """Read where and when the hive's robots charge from the parameters under `charging`."""
    name = f"{hive}charging/chargers"
    places = {}
    try:
        for entry in rospy.get_param(name, []):
            x, y, yaw = map(float, entry["pose"])
            places[str(entry["name"])] = Pose(x, y, yaw)
    except (KeyError, TypeError, ValueError) as error:
        raise SettingsError(
            f"{name} cannot be used ({error}); allowed: a list of chargers, each with a name and "
            "a pose [x, y, yaw] in the map frame [m, m, rad]"
        ) from None
    return ChargingPlan(places, params.read(ChargingSettings, f"{hive}charging"))
