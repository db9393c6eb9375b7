# SPDX-License-Identifier: BSD-3-Clause
"""The node that makes one robot a member of the hive."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Float64

from blackboard.domain import talker as topics
from blackboard.domain.battery import Battery
from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.settings import ControllerSettings, PathSettings, RobotSettings
from blackboard.domain.task import StepKind
from blackboard.errors import BlackboardError
from blackboard.robot.executor import Controller
from blackboard.robot.robot import Robot
from blackboard.ros import membership, params
from blackboard.ros.codec.charger_conversions import read_charging_plan
from blackboard.ros.codec.conversions import yaw_of
from blackboard.ros.commands import MoveBaseCommand, PickCommand
from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.rospy_patches import handshakes
from blackboard.ros.rospy_patches.prompt_sending import send_promptly
from blackboard.ros.rospy_patches.shared_reading import read_together
from blackboard.ros.talker import RosTalker
from hive_common.pose import Pose
from hive_common.ros.links import mend_links
from hive_common.ros.signals import end_on_signals

if TYPE_CHECKING:
    from blackboard.domain.characteristics import RobotCharacteristics

_SPEAKS = (topics.TASK_COST, topics.CHARGER_CLAIM)

_MAX_STEP = 1.0
"""Two odometry messages further apart than this are no drive but a reset [m]."""

_PATIENCE = 5.0
"""Wall time after which it is said again what is missing [s]."""


def main() -> None:
    """Run one robot's part of the hive until the node is shut down.

    The node lives in the robot's namespace; the hive is the namespace above it. Where it stands by
    to carry the blackboard too, it listens and may speak on all topics that the blackboard does.

    ROS Subscribers: `task_bc`, `task_assign`, `map`, `bb_backup`, `bb_entries` of the hive, and,
        where it stands by, those of the blackboard; `set_state`, `amcl_pose`, `odom` of the robot.
    ROS Publishers: `task_cost`, `task_state`, `robot_status`, `bb_ack` of the hive, and, where it
        stands by, those of the blackboard; `battery_state` of the robot.
    ROS Actions: client of the robot's `move_base` and, where it has an arm, `pick`.
    ROS Parameters: `characteristics` of the robot, `charging` of the hive (its chargers and
        thresholds); otherwise see config/robot.yaml.
    """
    end_on_signals()
    rospy.init_node("robot", disable_signals=True)
    handshakes.take_each_apart()
    send_promptly()
    read_together()
    mend_links()
    try:
        _run()
    except BlackboardError as error:
        rospy.logfatal(str(error))
        sys.exit(1)
    except rospy.ROSInterruptException:
        return


def _run() -> None:
    namespace = rospy.get_namespace()
    robot_id = namespace.strip("/").rpartition("/")[2]
    if not robot_id:
        raise BlackboardError(
            "this node has to run in its robot's namespace, for example robot1; "
            "start it with roslaunch blackboard robot.launch name:=robot1"
        )
    hive = namespace[: -len(robot_id) - 1]
    kinds = (RobotSettings, ControllerSettings, PathSettings)
    params.refuse_unknown(kinds, ["charge", "journal", "stands_by"])
    settings = params.read(RobotSettings)
    patience = params.read(ControllerSettings)
    characteristics = characteristics_from(rospy.get_param("characteristics", {}))
    battery = Battery(characteristics.battery, rospy.get_param("~charge", 1.0))
    stands_by = params.read_flag("stands_by", default=True)
    journal = membership.open_journal()
    speaks = membership.SPEAKS if stands_by else membership.SPEAKS_ASIDE
    talker = RosTalker(hive, (*_SPEAKS, *speaks))
    ways = RosPathLengths(talker, hive, params.read(PathSettings))
    controller = Controller(_commands(talker, characteristics, patience), talker, patience)
    backup = membership.join(talker, hive, ways, journal, stands_by=stands_by)
    robot = Robot(
        talker,
        robot_id,
        characteristics,
        battery,
        ways.of(characteristics.radius),
        controller,
        _first_pose(),
        settings,
        journal,
        backup,
        read_charging_plan(hive),
    )
    _Senses(talker, robot, battery, settings.status_period).start()
    robot.start()
    backup.start()
    talker.spin()


def _commands(
    talker: RosTalker, characteristics: RobotCharacteristics, patience: ControllerSettings
) -> dict[StepKind, MoveBaseCommand | PickCommand]:
    commands: dict[StepKind, MoveBaseCommand | PickCommand] = {
        StepKind.MOVE: MoveBaseCommand(talker, patience.server_timeout)
    }
    if any(kind.picks for kind in characteristics.capabilities):
        pick = PickCommand(talker, patience.server_timeout)
        commands |= {StepKind.PICK: pick, StepKind.PLACE: pick}
    return commands


def _first_pose() -> Pose:
    """Wait until the robot knows where it is; say what is missing while it does not."""
    while True:
        try:
            message = rospy.wait_for_message(
                "amcl_pose", PoseWithCovarianceStamped, timeout=_PATIENCE
            )
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            topic = rospy.resolve_name("amcl_pose")
            rospy.logwarn(f"no pose on {topic} yet; start the robot's localization")
        else:
            return _pose(message)


def _pose(msg: PoseWithCovarianceStamped) -> Pose:
    here = msg.pose.pose
    return Pose(here.position.x, here.position.y, yaw_of(here.orientation))


class _Senses:
    """Tells a robot where it is and how far it has driven, and everyone how full it is.

    Args:
        talker: Whose thread the robot lives in.
        robot: Who is told.
        battery: Its battery.
        period: Time between two battery states [s].

    ROS Subscribers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped), `odom`
        (nav_msgs/Odometry), `drop_charge` (std_msgs/Float64): a fault at will, the level to
        which the battery drops.
    ROS Publishers: `battery_state` (sensor_msgs/BatteryState).
    """

    def __init__(self, talker: RosTalker, robot: Robot, battery: Battery, period: float) -> None:
        self._talker = talker
        self._robot = robot
        self._battery = battery
        self._period = period
        self._odometry: tuple[float, float] | None = None
        self._publisher = rospy.Publisher("battery_state", BatteryState, queue_size=1)

    def start(self) -> None:
        """Begin to listen."""
        rospy.Subscriber(
            "amcl_pose",
            PoseWithCovarianceStamped,
            lambda msg: self._talker.call(lambda: self._robot.set_pose(_pose(msg))),
            queue_size=1,
        )
        rospy.Subscriber("odom", Odometry, lambda msg: self._talker.call(lambda: self._drive(msg)))
        rospy.Subscriber(
            "drop_charge", Float64, lambda msg: self._talker.call(lambda: self._drop(msg.data))
        )
        self._talker.every(self._period, self._say_battery)

    def _drive(self, msg: Odometry) -> None:
        here = (msg.pose.pose.position.x, msg.pose.pose.position.y)
        distance = math.dist(here, self._odometry or here)
        self._odometry = here
        if distance <= _MAX_STEP:
            self._robot.add_travel(distance)

    def _drop(self, level: float) -> None:
        try:
            self._battery.drop_to(level)
        except BlackboardError as error:
            rospy.logwarn(str(error))

    def _say_battery(self) -> None:
        battery = self._battery
        message = BatteryState(
            voltage=battery.get_volts(),
            charge=battery.charge_left,
            capacity=battery.capacity,
            design_capacity=battery.capacity,
            percentage=battery.level,
            current=math.nan,
            power_supply_status=BatteryState.POWER_SUPPLY_STATUS_CHARGING
            if self._robot.charging.is_charging
            else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
            power_supply_technology=BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
            present=True,
        )
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)
