# SPDX-License-Identifier: BSD-3-Clause
"""One AGV in the node `vda5050_agent`: between its messages and its robot's part of the hive."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import rospy
import tf2_ros
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import BatteryState
from std_msgs.msg import Bool

from blackboard.domain.battery import MeasuredBattery
from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.task import StepKind
from blackboard.robot.contact import Contact
from blackboard.robot.executor import Controller
from blackboard.ros.robot_node import join_hive, read_robot_settings
from hive_common.ros.conversions import pose_from_msg, pose_to_msg, transform_to_msg
from hive_common.structuring import structure
from hive_navigation.control.goal_tracker import NavigationSettings
from hive_navigation.control.navigator import Navigator
from hive_navigation.ros.map_topic import MapTeller
from hive_navigation.ros.path_teller import PathTeller
from robot_description.models import RobotModel
from vda5050.agent.agv import Agv
from vda5050.agent.body import with_own_scanners
from vda5050.agent.inspection import Inspector
from vda5050.agent.maker import read_maker
from vda5050.agent.order_follower import Tolerance
from vda5050.protocol.codec import encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Order
from vda5050.protocol.topics import Address, Topic
from vda5050.protocol.versions import Version

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.domain.settings import PathSettings
    from blackboard.domain.task import TaskStep
    from blackboard.process.talker import MemberTalker, ProcessTalker
    from blackboard.robot.executor import Command, CommandResult
    from blackboard.robot.robot import Robot
    from blackboard.ros.path_lengths import RosPathLengths
    from hive_common.pose import Pose
    from hive_common.ros.names import RobotNames
    from hive_navigation.planning.zoned_planner import ZonedPlanner
    from hive_navigation.ros.surroundings import Surroundings
    from vda5050.mqtt.link import Link
    from vda5050.protocol.codec import Body
    from vda5050.ros.vehicle_settings import AgentEntry

_IDLE_PERIOD = 1.0  # between two announcements of an AGV without a goal [s]
_TELL_PERIOD = 0.2  # between two poses that the robot's part of the hive gets [s]
_MAP_FRAME = "map"
_FURTHEST = 5.0  # two poses further apart are no drive but a new position [m]


class AgentMember:
    """One AGV as a robot of the hive; `content` is that of its robot model.

    What comes from the broker and the control loop belong to the thread of `surroundings`; the
    robot's part of the hive belongs to the talker's.

    ROS Publishers: `battery_state` (sensor_msgs/BatteryState) of the robot, and those of
        `MapTeller` and `PathTeller`; unless the simulator does so, `amcl_pose`
        (geometry_msgs/PoseWithCovarianceStamped) and tf from map to its base_footprint.
    ROS Subscribers: `pause` (std_msgs/Bool) and `initialpose`
        (geometry_msgs/PoseWithCovarianceStamped) of the robot.
    """

    def __init__(
        self,
        names: RobotNames,
        entry: AgentEntry,
        content: Mapping[str, Any],
        surroundings: Surroundings,
        link: Link,
    ) -> None:
        version = Version(entry.version)
        self.names, self.entry = names, entry
        self.address = Address.of(version, entry.manufacturer, entry.serial, entry.interface)
        self._version, self._surroundings, self._link = version, surroundings, link
        self._sent: dict[Topic, int] = {}
        model = with_own_scanners(structure(content, RobotModel))
        settings = NavigationSettings(settle=0.0)
        self._content = content
        self._radius = model.base.circumscribed_radius
        planner = surroundings.planner(self._radius)
        self.agv = Agv(
            entry.name,
            model,
            read_maker(entry.maker),
            self._send,
            f"{entry.name}-{time.time_ns() // 1_000_000:x}",
            rospy.get_time,
            rospy.logwarn,
            Tolerance(settings.position_tolerance, settings.yaw_tolerance),
            planner.field,
        )
        self._inspector = Inspector(
            self.address, version, time.time, self.agv.keeper.knows, rospy.logwarn
        )
        self._make_navigator: Callable[[ZonedPlanner], Navigator] = lambda planner: Navigator(
            entry.name, model, planner, self.agv.follower, planner.field, settings
        )
        self._map_teller = MapTeller(names, "vda5050_agent")
        self._path_teller = PathTeller(names, _MAP_FRAME)
        self._plan_with(planner)
        surroundings.give_routes_to(
            lambda routes: self._navigator.take_routes(routes, rospy.get_time())
        )
        surroundings.when_map_changes(lambda: self._plan_with(surroundings.planner(self._radius)))
        surroundings.when_zones_change(self._plan_again)
        self._robot: Robot | None = None
        self._talker: MemberTalker | None = None
        self._battery: MeasuredBattery | None = None
        self._announced_at = self._told_at = -math.inf
        self._contact, self._missing = Contact.KEPT, ""
        self._last: Pose | None = None
        self._broadcaster = tf2_ros.TransformBroadcaster()
        self._battery_state = rospy.Publisher(
            names.of("battery_state"), BatteryState, queue_size=1
        )
        if not entry.simulated:
            self._poses = rospy.Publisher(
                names.of("amcl_pose"), PoseWithCovarianceStamped, queue_size=1, latch=True
            )
        rospy.Subscriber(names.of("pause"), Bool, self._pause, queue_size=1)
        rospy.Subscriber(names.of("initialpose"), PoseWithCovarianceStamped, self._place)

    def _plan_again(self) -> None:
        self._navigator.plan_unless_guided()

    def _plan_with(self, planner: ZonedPlanner) -> None:
        """Plan on the map of a planner from now on; a goal that there is stays."""
        self._navigator = self._make_navigator(planner)
        self.agv.use(self._navigator, planner.field)
        self._map_teller.tell(self._surroundings.map.checksum)

    # Messages.

    def _send(self, body: Body) -> bool:
        topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
        number = self._sent.get(topic, -1) + 1
        self._sent[topic] = number
        header = Header(
            number % 2**32,
            timestamp_of(time.time()),
            self._version.text,
            self.address.manufacturer,
            self.address.serial,
        )
        payload = encode(header, body, self._version)
        return self._link.publish(self.address.topic(topic), payload)

    def hear(self, topic: Topic, payload: bytes) -> None:
        """Take in a message of the AGV, in the control loop's thread."""
        body = self._inspector.read(topic, payload)
        if body is not None:
            self.agv.hear(body)

    def _pause(self, message: Bool) -> None:
        self._surroundings.inbox.put(lambda: self.agv.pause(bool(message.data)))

    def _place(self, message: PoseWithCovarianceStamped) -> None:
        try:
            pose = pose_from_msg(message.pose.pose)
        except ValueError as error:
            rospy.logwarn(f"{self.names.of('initialpose')}: {error}")
            return
        self._surroundings.inbox.put(lambda: self.agv.init_position(pose))

    # The control loop.

    def round(self) -> None:
        """Do one round of the control loop."""
        now = rospy.get_time()
        said = self.agv.tick(now, self._surroundings.heard)
        idle = self._navigator.goal is None
        if said is not None and (not idle or now - self._announced_at >= _IDLE_PERIOD):
            self._announced_at = now
            self._surroundings.announce(said, _MAP_FRAME)
        self._path_teller.tell(self._navigator.path, rospy.Time.from_sec(now))
        if now - self._told_at >= _TELL_PERIOD or now < self._told_at:
            self._told_at = now
            self._tell(now)

    def _tell(self, now: float) -> None:
        """Tell the robot's part of the hive where and how the AGV is."""
        robot, talker, battery, agv = self._robot, self._talker, self._battery, self.agv
        pose, charge = agv.pose, agv.charge
        if pose is None:
            return
        if not self.entry.simulated:
            self._show(pose, rospy.Time.from_sec(now))
        driven = 0.0 if self._last is None else pose.distance_to(self._last)
        self._last = pose
        if robot is None or talker is None or battery is None:
            return
        trouble, contact = agv.trouble(now), agv.contact(now)
        self._note_contact(contact, now)
        wanted = robot.charging.is_charging
        agv.charge_if(wanted, now)

        def tell() -> None:
            if charge is not None:
                battery.measure(charge)
            robot.set_pose(pose)
            if driven <= _FURTHEST:
                robot.add_travel(driven)
            robot.note_trouble(trouble)
            robot.note_contact(contact)

        talker.call(tell)
        self._publish_battery(battery)

    def _show(self, pose: Pose, stamp: rospy.Time) -> None:
        """Publish where the AGV is, as the localization of other robots does."""
        frame = f"{self.names.robot}/base_footprint"
        self._broadcaster.sendTransform(transform_to_msg(pose, _MAP_FRAME, frame, stamp))
        message = PoseWithCovarianceStamped()
        stamped = pose_to_msg(pose, _MAP_FRAME, stamp)
        message.header, message.pose.pose = stamped.header, stamped.pose
        self._poses.publish(message)

    def _note_contact(self, contact: Contact, now: float) -> None:
        self._missing = self.agv.presence.word(now)
        if contact is Contact.LOST and self._contact is not Contact.LOST:
            rospy.logwarn(
                f"{self.names.robot}: {self._missing}; it has come to the end of its base by now: "
                "on_robot_lost decides about its tasks, and others keep off its base"
            )
        self._contact = contact

    def _publish_battery(self, battery: MeasuredBattery) -> None:
        state = self.agv.state
        charging = state is not None and state.power_supply.charging
        message = BatteryState(
            voltage=battery.get_volts(),
            charge=battery.charge_left,
            capacity=battery.capacity,
            design_capacity=battery.capacity,
            percentage=battery.level,
            current=math.nan,
            power_supply_status=BatteryState.POWER_SUPPLY_STATUS_CHARGING
            if charging
            else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
            present=True,
        )
        message.header.stamp = rospy.Time.now()
        self._battery_state.publish(message)

    # The hive.

    @property
    def is_ready(self) -> bool:
        """Whether the AGV has told where it is, and has no part in the hive yet."""
        return self._robot is None and self.agv.pose is not None

    def join(
        self, process: ProcessTalker, lengths_by: Callable[[PathSettings], RosPathLengths]
    ) -> None:
        """Become a robot of the hive, in the talker's thread."""
        names, pose = self.names, self.agv.pose
        if pose is None:
            return
        body = characteristics_from(self._content)
        battery = MeasuredBattery(body.battery, self.agv.charge or 1.0)
        _, patience = read_robot_settings(names)
        talker = process.member(names.node, names.robot, names.of(""))
        command: Command = AgvCommand(self.agv, self.round, talker, self._surroundings)
        controller = Controller(
            dict.fromkeys(StepKind, command), talker.world, patience, lambda: self._missing
        )
        robot, node = join_hive(talker, names, body, battery, controller, lengths_by, lambda: pose)
        robot.start()
        node.start()
        self._talker, self._battery, self._robot = talker, battery, robot


class AgvCommand:
    """Makes an AGV do steps; see `blackboard.robot.executor.Command`.

    Args:
        agv: The AGV.
        look: Does a round of the AGV at once, so that its order does not wait for the next one.
        talker: Its thread gets the results.
        surroundings: Its thread is the AGV's.
    """

    def __init__(
        self,
        agv: Agv,
        look: Callable[[], None],
        talker: MemberTalker,
        surroundings: Surroundings,
    ) -> None:
        self._agv, self._look, self._talker = agv, look, talker
        self._inbox = surroundings.inbox
        self._run = 0

    def start(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Begin a step."""
        self._run += 1
        run = self._run

        def end(result: CommandResult) -> None:
            self._talker.call(lambda: done(result) if run == self._run else None)

        def begin() -> None:
            if step.kind is StepKind.MOVE:
                self._agv.drive(step.goal, end)
            else:
                self._agv.handle(step, end)
            self._look()

        self._inbox.put(begin)

    def cancel(self) -> None:
        """Stop; harmless when nothing runs."""
        self._run += 1
        self._inbox.put(self._agv.stop)
