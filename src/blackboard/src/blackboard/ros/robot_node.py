# SPDX-License-Identifier: BSD-3-Clause
"""The robot node: one robot's part of the hive, and its member."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import rospy
from robot_description.msg import MapInUse

from blackboard.domain.battery import Battery
from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.charger import Charger
from blackboard.domain.settings import (
    ChargingSettings,
    ControllerSettings,
    PathSettings,
    RobotSettings,
)
from blackboard.domain.talker import LEARNER_TOPICS, ROBOT_TOPICS, VOTER_TOPICS
from blackboard.domain.task import StepKind
from blackboard.robot.charging import ChargingPlan
from blackboard.robot.executor import Controller
from blackboard.robot.robot import Robot
from blackboard.ros import membership
from blackboard.ros.commands import ActionCommand, MoveBaseCommand, PickCommand
from blackboard.ros.guard_process import GuardProcess
from blackboard.ros.learned_parameter import LearnedParameter
from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.senses import Senses, wait_for_pose
from blackboard.ros.startup import run_node
from blackboard.ros.transport import PARAMETER, make_talker
from hive_common.map_id import MapId
from hive_common.ros import params
from hive_common.ros.names import own_names

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from blackboard.consensus.node import RaftNode
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.process.talker import MemberTalker, ProcessTalker
    from blackboard.robot.drive_guard import Guard
    from blackboard.robot.executor import Command
    from hive_common.pose import Pose
    from hive_common.ros.names import RobotNames

_Settings = TypeVar("_Settings")

_PART = "robot_node"
"""What the part of a robot is called that bids, among those that use a map."""

_MAP_IN_USE = "map_in_use"
_MOST_LETTERS = 64


def main() -> None:
    """Run one robot's part of the hive until the node is shut down.

    The node runs in the robot's namespace; the namespace above it is the hive's. A robot that
    `stands_by` subscribes to and advertises everything that the blackboard node does as well.

    ROS Subscribers: `task_bc`, `task_assign`, `map`, `bb_backup`, `bb_entries` of the hive;
        `set_state`, `amcl_pose`, `odom`, `drop_charge`, `map_in_use` of the robot.
    ROS Publishers: `task_cost`, `task_state`, `robot_status`, `bb_ack` of the
        hive; `battery_state` of the robot; `/diagnostics`.
    ROS Actions: client of the robot's `move_base` and, if it has an arm, `pick`. A process of its
        own cancels the goal of `move_base` when this one hangs or ends.
    ROS Parameters: `characteristics` of the robot and `charging` of the hive (its chargers and
        thresholds); `zenoh`, see `transport.make_talker`; for all others see config/robot.yaml.
    """
    run_node("robot", _run)


def _run() -> None:
    names = own_names()
    talker = make_talker(names.hive, topics_of([names]))
    lengths = lambda settings: RosPathLengths(talker, names.hive, settings)  # noqa: E731  (one argument)
    start_robot(talker, names, lengths, GuardProcess())
    talker.spin()


def _stands_by(names: RobotNames) -> bool:
    """Return whether a robot stands by to carry the blackboard."""
    return params.flag("stands_by", default=True, node=names.node)


def topics_of(robots: Iterable[RobotNames]) -> dict[str, tuple[str, ...]]:
    """Return the topics of the hive on which each robot of a process speaks."""
    return {
        names.robot: (*ROBOT_TOPICS, *(VOTER_TOPICS if _stands_by(names) else LEARNER_TOPICS))
        for names in robots
    }


def start_robot(
    process: ProcessTalker,
    names: RobotNames,
    lengths_by: Callable[[PathSettings], RosPathLengths],
    guard: Guard,
) -> None:
    """Start one robot's part of the hive; it waits for the map and the robot's pose.

    Args:
        process: The talker of this process; the caller lets it spin.
        names: The robot's names.
        lengths_by: Makes path lengths on the hive's map, as the settings say.
        guard: Ends the robot's drives when this process hangs or ends.

    Raises:
        ParameterError: A parameter is missing, unknown or has a value that is not allowed.
        JournalError: The robot's journal cannot be used.
        rospy.ROSInterruptException: The node was shut down first.
    """
    name = names.node
    body = characteristics_from(rospy.get_param(names.of("characteristics"), {}))
    charge = params.number("charge", least=0.0, most=1.0, default=1.0, node=name)
    battery = Battery(body.battery, charge)
    settings, patience = read_robot_settings(names)
    talker = process.member(name, names.robot, names.of(""))
    drive = MoveBaseCommand(talker, patience.server_timeout, guard)
    servers: list[ActionCommand] = [drive]
    commands: dict[StepKind, Command] = {StepKind.MOVE: drive}
    if any(kind.picks for kind in body.capabilities):
        pick = PickCommand(talker, patience.server_timeout)
        commands |= {StepKind.PICK: pick, StepKind.PLACE: pick}
        servers.append(pick)

    def missing() -> str:
        return next(filter(None, (server.gone for server in servers)), "")

    controller = Controller(commands, talker.world, patience, missing)
    robot, node = join_hive(
        talker, names, body, battery, controller, lengths_by, lambda: wait_for_pose(talker.own)
    )
    Senses(talker, robot, battery, settings.status_period).start()
    robot.start()
    robot.tell_lease_to(drive.hold_until)
    node.start()


def read_robot_settings(names: RobotNames) -> tuple[RobotSettings, ControllerSettings]:
    """Read the parameters of a robot's part of the hive.

    Raises:
        ParameterError: One is unknown or has a value that is not allowed.
    """
    name = names.node
    kinds = (RobotSettings, ControllerSettings, PathSettings)
    params.refuse_unknown(kinds, ["charge", "journal", "stands_by", PARAMETER], node=name)
    return _shared(RobotSettings, names), params.read(ControllerSettings, name)


def _shared(kind: type[_Settings], names: RobotNames) -> _Settings:
    """Read settings; those that the robot leaves open are the fleet's.

    Costs of two models cannot be compared: a robot that joins and bids by another model than the
    rest would get every task, or none.
    """
    return params.read(kind, names.node, shared=f"{names.hive}fleet")


def join_hive(
    talker: MemberTalker,
    names: RobotNames,
    body: RobotCharacteristics,
    battery: Battery,
    controller: Controller,
    lengths_by: Callable[[PathSettings], RosPathLengths],
    wait_for_pose: Callable[[], Pose],
) -> tuple[Robot, RaftNode]:
    """Make a robot and its member of the hive; the caller starts both, in this order.

    Args:
        talker: The robot's.
        names: The robot's names.
        body: What the robot is.
        battery: How full it is.
        controller: Makes it do its tasks.
        lengths_by: Makes path lengths on the hive's map, as the settings say.
        wait_for_pose: Returns where the robot is, frame map, as soon as that is known.
    """
    name = names.node
    settings, _ = read_robot_settings(names)
    path_lengths = lengths_by(_shared(PathSettings, names))
    journal = membership.open_journal(name)
    node = membership.join(talker, names.hive, path_lengths, journal, stands_by=_stands_by(names))
    robot = Robot(
        talker,
        names.robot,
        body,
        battery,
        path_lengths.of(body.radius),
        controller,
        wait_for_pose(),
        settings,
        journal,
        node,
        charging_plan(names.hive),
    )
    learned = LearnedParameter(names)
    robot.learning.begin_with(learned.of_model())
    robot.learning.tell_to(learned.tell)
    path_lengths.follow(lambda used: robot.maps.note(_PART, used))
    hear = talker.take(_MAP_IN_USE, lambda msg: _note_map(robot, talker, msg))
    rospy.Subscriber(names.of(_MAP_IN_USE), MapInUse, hear)
    return robot, node


def _note_map(robot: Robot, talker: MemberTalker, msg: MapInUse) -> None:
    used = MapId(msg.name, msg.checksum)
    if max(map(len, (msg.node, *used))) > _MOST_LETTERS:
        talker.refuse(_MAP_IN_USE, f"a text is longer than {_MOST_LETTERS} characters")
        return
    robot.maps.note(msg.node, used)


def charging_plan(hive: str) -> ChargingPlan:
    """Read where and when the hive's robots charge from the parameters under `charging`."""
    name = f"{hive}charging/chargers"
    chargers = params.structured(name, tuple[Charger, ...], [])
    places = {charger.name: charger.pose for charger in chargers}
    return ChargingPlan(places, params.read(ChargingSettings, f"{hive}charging"))
