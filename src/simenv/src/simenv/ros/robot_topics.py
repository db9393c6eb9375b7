# SPDX-License-Identifier: BSD-3-Clause
"""The topics of one simulated robot, the same as those of a real one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import nav_msgs.msg
import rospy
import sensor_msgs.msg
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, Header

from hive_common.ros.conversions import transform_to_msg
from simenv.errors import CommandError
from simenv.pacing import Every
from simenv.ros.conversions import odometry_msg, scan_msg, stamp_of
from simenv.ros.pick_server import PickServer
from simenv.simulation import STEP

if TYPE_CHECKING:
    from geometry_msgs.msg import TransformStamped

    from hive_common.ros.inbox import Inbox
    from simenv.pacing import Lockstep
    from simenv.simulation import Simulation

ODOMETRY_RATE = 20.0  # [Hz, simulated time]
TRUTH_RATE = 10.0  # [Hz, simulated time]; as often as `fake_localization` needs it
MAX_CONTROL_PERIOD = 0.5  # a base stops without a command for this long [s, simulated time]
FEEDBACK_RATE = 5.0  # [Hz, simulated time]
_QUEUE_SIZE = 5  # messages queued for a slow subscriber; a frozen one must not stop the simulation


class RobotTopics:
    """Publishes what a robot senses, and passes on its commands.

    ROS Publishers:
        <robot>/odom (nav_msgs/Odometry): 20 Hz; <robot>/base_footprint in <robot>/odom.
        <robot>/scan (sensor_msgs/LaserScan): at the rate of the model's laser; <robot>/laser.
        <robot>/bumper (std_msgs/Bool): latched; true while it touches something.
        <robot>/ground_truth (nav_msgs/Odometry): 10 Hz; <robot>/base_footprint in map.
    ROS Subscribers:
        <robot>/cmd_vel (geometry_msgs/Twist): linear x, y [m/s] and angular z [rad/s] count. If
            the publisher's connection header has a `control_period` [s], simulated time waits for
            each command that is due, as long as anybody publishes.
    ROS Actions:
        <robot>/pick: see `PickServer`; only for robots with an arm.
    """

    def __init__(
        self, name: str, simulation: Simulation, inbox: Inbox, lockstep: Lockstep, phase: int
    ) -> None:
        """Open the topics of the robot `name`; `phase` shifts its scans by so many steps."""
        self._name = name
        self._simulation = simulation
        self._inbox = inbox
        self._lockstep = lockstep
        self._laser = simulation.model(name).laser
        self._odometry_due = Every(ODOMETRY_RATE, STEP)
        self._truth_due = Every(TRUTH_RATE, STEP)
        self._feedback_due = Every(FEEDBACK_RATE, STEP)
        self._scan_due = Every(self._laser.rate, STEP, phase)
        self._odom = _publisher(f"{name}/odom", nav_msgs.msg.Odometry)
        self._truth = _publisher(f"{name}/ground_truth", nav_msgs.msg.Odometry)
        self._scan = _publisher(f"{name}/scan", sensor_msgs.msg.LaserScan)
        self._bumper = rospy.Publisher(f"{name}/bumper", Bool, queue_size=1, latch=True)
        self._touching: bool | None = None
        self._pick = PickServer(name, simulation, inbox) if simulation.arm(name).can_pick else None
        self._commands = rospy.Subscriber(
            f"{name}/cmd_vel", Twist, self._heard, queue_size=1, tcp_nodelay=True
        )

    def close(self) -> None:
        """Close the topics."""
        for topic in (self._commands, self._odom, self._truth, self._scan, self._bumper):
            topic.unregister()
        if self._pick is not None:
            self._pick.stop()

    def _heard(self, twist: Twist) -> None:
        self._inbox.put(lambda: self._command(twist))

    def _command(self, twist: Twist) -> None:
        if self._name not in self._simulation.names:
            return
        command = twist.linear.x, twist.linear.y, twist.angular.z
        try:
            self._simulation.set_command(self._name, *command)
        except CommandError as error:
            rospy.logwarn_throttle(5.0, str(error))
            return
        period = _control_period(twist._connection_header)  # noqa: SLF001  (rospy has no other way)
        now = self._simulation.nanoseconds
        self._lockstep.note(self._name, now, period, moves=any(command), is_there=self._has_driver)

    def _has_driver(self) -> bool:
        """Return whether anybody can still send a command."""
        return bool(self._commands.get_num_connections())

    def collect(self, nanoseconds: int) -> list[tuple[rospy.Publisher, object]]:
        """Return the messages that are due after the step that ended at this time [ns]."""
        stamp = stamp_of(nanoseconds)
        due: list[tuple[rospy.Publisher, object]] = []
        if self._odometry_due.due(nanoseconds):
            due.append((self._odom, self._odometry(stamp)))
        if self._truth_due.due(nanoseconds) and self._truth.get_num_connections():
            due.append((self._truth, self._ground_truth(stamp)))
        if self._scan_due.due(nanoseconds) and self._scan.get_num_connections():
            due.append((self._scan, self._measure(stamp)))
        return due

    def report(self, nanoseconds: int) -> None:
        """Publish news of the bumper and the arm."""
        touching = bool(self._simulation.bumper(self._name))
        if touching is not self._touching:
            self._touching = touching
            self._bumper.publish(Bool(touching))
        if self._pick is not None:
            self._pick.report()
            if self._feedback_due.has_come(nanoseconds):
                self._pick.feed_back()

    def transform(self, nanoseconds: int) -> TransformStamped | None:
        """Return the transform of the odometry, or None if it is not due."""
        if not self._odometry_due.due(nanoseconds):
            return None
        pose, stamp = self._simulation.odometry(self._name), stamp_of(nanoseconds)
        return transform_to_msg(pose, f"{self._name}/odom", f"{self._name}/base_footprint", stamp)

    def _odometry(self, stamp: rospy.Time) -> nav_msgs.msg.Odometry:
        return odometry_msg(
            Header(stamp=stamp, frame_id=f"{self._name}/odom"),
            f"{self._name}/base_footprint",
            self._simulation.odometry(self._name),
            self._simulation.velocity(self._name),
        )

    def _ground_truth(self, stamp: rospy.Time) -> nav_msgs.msg.Odometry:
        return odometry_msg(
            Header(stamp=stamp, frame_id="map"),
            f"{self._name}/base_footprint",
            self._simulation.poses[self._name],
            self._simulation.velocity(self._name),
        )

    def _measure(self, stamp: rospy.Time) -> sensor_msgs.msg.LaserScan:
        return scan_msg(
            Header(stamp=stamp, frame_id=f"{self._name}/laser"),
            self._laser,
            self._simulation.scanner(self._name).angles,
            self._simulation.scan(self._name),
        )


def _control_period(header: dict[str, str]) -> float:
    """Return the period of the control loop behind a connection [s, simulated time], or 0."""
    try:
        period = float(header.get("control_period", 0.0))
    except ValueError:
        return 0.0
    return period if STEP <= period <= MAX_CONTROL_PERIOD else 0.0


def _publisher(topic: str, kind: type) -> rospy.Publisher:
    return rospy.Publisher(topic, kind, queue_size=_QUEUE_SIZE, tcp_nodelay=True)
