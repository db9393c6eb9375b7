# SPDX-License-Identifier: BSD-3-Clause
"""What a robot senses on ROS: where it is, how far it has driven, and how full its battery is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Float64

from blackboard.domain.clock_offsets import ClockOffsets, words
from blackboard.errors import BlackboardError
from blackboard.process.talker import LEADER
from blackboard.ros.startup import wait_for
from hive_common.pose import Pose
from hive_common.ros.conversions import pose_from_msg

if TYPE_CHECKING:
    from blackboard.domain.battery import Battery
    from blackboard.process.talker import MemberTalker
    from blackboard.robot.robot import Robot

_BASE = "base"
_POSE, _ODOM, _DROP = "amcl_pose", "odom", "drop_charge"

_MAX_STEP = 1.0
"""Two odometry messages further apart than this are a reset, not a drive [m]."""


def wait_for_pose(own: str) -> Pose:
    """Wait until localization says where the robot of a namespace is; see `wait_for`."""
    remedy = "start the robot's localization"
    while True:
        msg = wait_for(f"{own}{_POSE}", PoseWithCovarianceStamped, "pose", remedy)
        try:
            return pose_from_msg(msg.pose.pose)
        except ValueError as error:
            rospy.logwarn_throttle_identical(10, f"a message on {own}{_POSE} is refused: {error}")


class Senses:
    """Feeds a robot with its poses and drives, and publishes the state of its battery.

    Args:
        period: Time between two battery states [s].

    ROS Subscribers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped), `odom`
        (nav_msgs/Odometry), `drop_charge` (std_msgs/Float64): the level to which the battery
        drops, to test how the hive copes.
    ROS Publishers: `battery_state` (sensor_msgs/BatteryState).
    """

    def __init__(
        self, talker: MemberTalker, robot: Robot, battery: Battery, period: float
    ) -> None:
        self._talker = talker
        self._robot = robot
        self._battery = battery
        self._period = period
        self._odometry: tuple[float, float] | None = None
        self._late: float | None = None  # how long after its stamp the last odometry came [s]
        self._base_clock = ClockOffsets()
        self._simulated = bool(rospy.get_param("/use_sim_time", default=False))
        self._publisher = rospy.Publisher(f"{talker.own}battery_state", BatteryState, queue_size=1)

    def start(self) -> None:
        """Begin to listen and to publish."""
        own, take = self._talker.own, self._talker.take
        rospy.Subscriber(
            f"{own}{_POSE}",
            PoseWithCovarianceStamped,
            take(_POSE, self._locate),
            queue_size=1,
        )
        rospy.Subscriber(f"{own}{_ODOM}", Odometry, take(_ODOM, self._drive))
        rospy.Subscriber(f"{own}{_DROP}", Float64, take(_DROP, self._drop))
        self._talker.world.every(self._period, self._publish_battery)
        if not self._simulated:
            self._talker.every(self._period, self._compare_clocks)

    def _compare_clocks(self) -> None:
        """Have the robot say whose clock is off: this computer's, or that of its base."""
        now = self._talker.now()
        if self._late is not None:
            self._base_clock.hear(_BASE, self._late, now)
            self._late = None
        leader, base = self._talker.clocks.behind(LEADER, now), self._base_clock.behind(_BASE, now)
        texts = []
        if leader:
            texts.append(f"its clock is {words(-leader)} the leader's")
        if base:
            texts.append(f"the clock that stamps its odom is {words(base)} its robot_node's")
        self._robot.trouble = "; ".join(texts)

    def _locate(self, msg: PoseWithCovarianceStamped) -> None:
        try:
            pose = pose_from_msg(msg.pose.pose)
        except ValueError as error:
            self._talker.refuse(_POSE, str(error))
            return
        self._robot.set_pose(pose)

    def _drive(self, msg: Odometry) -> None:
        # Only the way counts: some bases never send an orientation.
        place = Pose(msg.pose.pose.position.x, msg.pose.pose.position.y)
        if place.flaw:
            self._talker.refuse(_ODOM, f"position ({place.x:g}, {place.y:g}) {place.flaw}")
            return
        if not msg.header.stamp.is_zero():  # no stamp at all says nothing of a clock
            self._late = rospy.get_time() - msg.header.stamp.to_sec()
        here = place[:2]
        distance = math.dist(here, self._odometry or here)
        self._odometry = here
        if distance <= _MAX_STEP:
            self._robot.add_travel(distance)

    def _drop(self, msg: Float64) -> None:
        try:
            self._battery.drop_to(msg.data)
        except BlackboardError as error:
            rospy.logwarn(str(error))

    def _publish_battery(self) -> None:
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
