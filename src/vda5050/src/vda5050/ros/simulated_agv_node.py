# SPDX-License-Identifier: BSD-3-Clause
"""Several simulated AGVs in one process, each on a robot of the simulator."""

from __future__ import annotations

import time
from collections import ChainMap
from typing import TYPE_CHECKING

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from blackboard.ros.startup import run_node
from hive_common.pose import STOP, Velocity
from hive_common.ros.conversions import pose_from_msg
from hive_common.ros.inbox import Inbox
from hive_common.ros.names import RobotNames
from hive_common.ros.params import structured
from hive_navigation.control.catching_up import RECENT
from hive_navigation.ros.fake_localization_node import FakeLocalization
from robot_description.models import load_model
from simenv.ros.spawning import spawn_each
from vda5050.errors import FaultError
from vda5050.mqtt.link import BrokerSettings
from vda5050.protocol.topics import Address
from vda5050.protocol.versions import Version
from vda5050.ros.vehicle_link import CONTROL_PERIOD, VehicleLink, keep_stepping
from vda5050.ros.vehicle_settings import AgvEntry
from vda5050.simulated.agv import AgvSettings, SimulatedAgv

if TYPE_CHECKING:
    from hive_common.pose import Pose

_SPAWN_WITHIN = 120.0
"""Time to wait for the simulator [s, wall clock]."""


class RosBase:
    """A robot of the simulator as the base of an AGV, over its topics.

    It knows its true pose, as an AGV that follows reflectors or a line on the floor does.

    ROS Subscribers: `ground_truth` (nav_msgs/Odometry).
    ROS Publishers: `cmd_vel` (geometry_msgs/Twist).
    """

    def __init__(self, robot: str, inbox: Inbox) -> None:
        self.pose: Pose | None = None
        self.velocity = STOP
        self._heard = f"{robot}/ground_truth"
        self._measured: float | None = None  # when the pose was [s]
        # A simulator waits for commands that come once a period of simulated time.
        period = {"control_period": f"{CONTROL_PERIOD:.6f}"}
        self._cmd_vel = rospy.Publisher(f"{robot}/cmd_vel", Twist, queue_size=1, headers=period)
        rospy.Subscriber(
            self._heard,
            Odometry,
            lambda message: inbox.put(lambda: self._hear(message)),
            queue_size=1,
            tcp_nodelay=True,
        )
        rospy.on_shutdown(lambda: self._cmd_vel.publish(Twist()))

    def _hear(self, message: Odometry) -> None:
        twist = message.twist.twist
        self.pose = pose_from_msg(message.pose.pose)
        self._measured = message.header.stamp.to_sec()
        self.velocity = Velocity(twist.linear.x, twist.linear.y, twist.angular.z)

    def recent_until(self) -> dict[str, float]:
        """Return until when the pose counts as recent [s]; see `CatchingUp`."""
        return {} if self._measured is None else {self._heard: self._measured + RECENT}

    def command(self, velocity: Velocity) -> None:
        """Move like this until the next command."""
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = velocity
        self._cmd_vel.publish(twist)


class _Member:
    """One AGV, its connection to the broker, and its topics."""

    def __init__(self, entry: AgvEntry, map_id: str, broker: BrokerSettings, inbox: Inbox) -> None:
        self._name = entry.name
        version = Version(entry.version)
        address = Address.of(version, entry.manufacturer, entry.serial, entry.interface)
        self._link = VehicleLink(broker, address, inbox)
        settings = AgvSettings(
            address=address, version=version, map_id=map_id, rates=entry.rates, charge=entry.charge
        )
        FakeLocalization(RobotNames(rospy.get_namespace(), entry.name))
        self._base = base = RosBase(entry.name, inbox)
        model = load_model(entry.model)
        self.agv = SimulatedAgv(settings, model, base, self._link.send, time.time)
        rospy.Subscriber(
            f"{entry.name}/agv_fault",
            String,
            lambda message: inbox.put(lambda: self._fault(message.data)),
        )

    def recent_until(self) -> dict[str, float]:
        """Return until when what it acts on counts as recent [s]; see `CatchingUp`."""
        return self._base.recent_until()

    def start(self) -> None:
        """Connect to the broker."""
        self._link.start(self.agv.endpoint, self.agv.hear)

    def stop(self) -> None:
        """Say goodbye."""
        self._link.stop()

    def _fault(self, line: str) -> None:
        try:
            self.agv.mischief.do(line)
        except FaultError as error:
            rospy.logwarn(f"{self._name}: {error}")


def main() -> None:
    """Run the AGVs until the node is shut down.

    ROS Services called: `simenv/spawn`.
    ROS Publishers: those of `RosBase` and `FakeLocalization`, for RViz.
    ROS Subscribers: those of `RosBase`, and `<robot>/agv_fault` (std_msgs/String), a fault as
        `vda5050.simulated.mischief` reads it.
    ROS Parameters: `~agvs`, a list of `AgvEntry`; `~broker`, see `BrokerSettings`; `~map_id`
        (map).
    """
    run_node("simulated_agv", _run)


def _run() -> None:
    wanted = structured("~agvs", tuple[AgvEntry, ...], [])
    broker = structured("~broker", BrokerSettings, {})
    map_id = str(rospy.get_param("~map_id", "map"))
    entries = spawn_each(wanted, lambda each: (each.name, each.model, each.pose), _SPAWN_WITHIN)
    inbox = Inbox()
    members = [_Member(entry, map_id, broker, inbox) for entry in entries]
    for member in members:
        member.start()

    def recent_until() -> dict[str, float]:
        return dict(ChainMap(*(member.recent_until() for member in members)))

    try:
        keep_stepping([member.agv.step for member in members], inbox, recent_until)
    finally:
        for member in members:
            member.stop()
