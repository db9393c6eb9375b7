# SPDX-License-Identifier: BSD-3-Clause
"""The command line's link to the hive on ROS; see `fleet_manager.client.client.ClientLink`."""

from __future__ import annotations

import contextlib
import logging
import os
import time
from functools import partial
from typing import TYPE_CHECKING

import rosgraph
import rospy

from blackboard.domain.characteristics import characteristics_from
from blackboard.domain.talker import ROBOT_STATUS
from blackboard.errors import BlackboardError
from fleet_manager.client.client import DEFAULT_URI
from fleet_manager.client.reports import BatteryReading, Collisions, HiveMessage, TruePlace
from fleet_manager.desk.topic_link import LOOK, TopicLink
from fleet_manager.errors import NoHiveError
from fleet_manager.ros.hive_topics import QUEUE_SIZE, HiveTopics
from fleet_manager.ros.map_service import change_map
from fleet_manager.ros.place_parameter import hive_places
from fleet_manager.ros.troubles import Troubles
from hive_common.ros.reconnecting import keep_connected

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import BatteryState
    from std_msgs.msg import UInt32

    from hive_common.pose import Pose

_TOLD_WITHIN = 1.5  # [s] in which members tell on /diagnostics what is wrong
_NO_ROBOT = "blackboard"  # the node that may tell other robots' status, and has none itself


@contextlib.contextmanager
def connect(record: Sequence[str] = ()) -> Iterator[RosClientLink]:
    """Open a link to the hive whose ROS master is at ROS_MASTER_URI; close it at the end.

    The ground truth and the battery of the robots in `record` are reported too, with the
    collisions that the simulator counts. Raise NoHiveError if no ROS master answers.
    """
    demand_master()
    logging.disable(logging.WARNING)
    rospy.init_node("hive", anonymous=True, disable_signals=True, disable_rosout=True)
    keep_connected()
    link = RosClientLink()
    link.record(record)
    try:
        yield link
    finally:
        _leave()


def _leave() -> None:
    """Tell the master and close all connections.

    `rospy.signal_shutdown` does the same and then waits half a second for its threads.
    """
    for hook in rospy.core._preshutdown_hooks:  # noqa: SLF001  (rospy has no other way)
        hook("the command has ended")


def demand_master() -> None:
    """Raise NoHiveError unless the ROS master of ROS_MASTER_URI answers."""
    os.environ.setdefault("ROS_MASTER_URI", DEFAULT_URI)
    if not rosgraph.is_master_online():
        raise NoHiveError(
            f"no ROS master answers at {rosgraph.get_master_uri()}; start a hive with "
            "`roslaunch fleet_manager fleet_manager.launch`, or set ROS_MASTER_URI"
        )


class RosClientLink(TopicLink):
    """Hands over what the hive says, one report at a time, and publishes requests.

    ROS Subscribers and Publishers:
        Those of `HiveTopics` that are asked for, and of the robots that are recorded
        ROBOT/ground_truth (nav_msgs/Odometry), ROBOT/battery_state (sensor_msgs/BatteryState),
        and simenv/collisions (std_msgs/UInt32).
    """

    def __init__(self) -> None:
        super().__init__()
        self._topics: HiveTopics = HiveTopics(self._put)
        self._commanded: set[str] = set()
        self._robots: set[str] | None = (
            None  # the nodes that speak for robots, once they are known
        )

    def _known_time(self) -> float:
        """Return ROS's time [s]; a simulated one is known once a message of /clock has come."""
        return float(rospy.get_time())

    def has_heard_robots(self) -> bool:
        """Return whether all robots have told their status, and `receive` has given it out.

        Only of a node that says for which robots it speaks, as ours do, this is known.
        """
        if self._robots is None:
            publishers = dict(rosgraph.Master(rospy.get_name()).getSystemState()[0])
            nodes = publishers.get(rospy.resolve_name(ROBOT_STATUS), ())
            self._robots = {*nodes} - {rospy.resolve_name(_NO_ROBOT)}
        robots_of = self._topics.robots_of
        heard = bool(self._robots) and all(
            node in robots_of and robots_of[node] <= self._topics.heard for node in self._robots
        )
        # What a callback has heard is in the queue before it counts as heard.
        return heard and self._reports.empty()

    def troubles(self) -> Sequence[str]:
        """Return what members and nodes of the hive say is wrong, after listening for a while."""
        found = Troubles()
        end = self.now() + _TOLD_WITHIN
        while not found.read() and self.now() < end:
            time.sleep(LOOK)
        return found.read()

    def record(self, robots: Sequence[str]) -> None:
        """Report, from now on, what the simulator and these robots tell a recorder."""
        if not robots:
            return
        from nav_msgs.msg import Odometry  # noqa: PLC0415  (few commands record)
        from sensor_msgs.msg import BatteryState  # noqa: PLC0415  (see above)
        from std_msgs.msg import UInt32  # noqa: PLC0415  (see above)

        for robot in robots:
            for name, message, hear in (
                ("ground_truth", Odometry, self._hear_place),
                ("battery_state", BatteryState, self._hear_battery),
            ):
                topic = f"{robot}/{name}"
                rospy.Subscriber(topic, message, partial(hear, robot), queue_size=QUEUE_SIZE)
        rospy.Subscriber("simenv/collisions", UInt32, self._hear_collisions)

    def set_state(self, robot: str, word: str) -> None:
        """Publish a word on a robot's `set_state`, once."""
        if robot not in self._commanded:
            self._commanded.add(robot)
            self._topics.advertise_to(robot)
        super().set_state(robot, word)

    def places(self) -> Mapping[str, Pose]:
        """Return the named places of the hive's building [map frame]."""
        return hive_places()

    def radius_of(self, robot: str) -> float | None:
        """Return how close a robot's middle may come to what is blocked [m]; None if unknown."""
        try:
            return characteristics_from(rospy.get_param(f"{robot}/characteristics")).radius
        except (rospy.ROSException, KeyError, OSError, BlackboardError):
            return None

    def learned_of(self, robot: str) -> object:
        """Return what a robot's parameter `learned` holds, None if it has none.

        Raises:
            NoHiveError: The ROS master no longer answers.
        """
        try:
            return rospy.get_param(f"{robot}/learned", None)
        except (rospy.ROSException, OSError) as error:
            raise NoHiveError(
                f"the ROS master at {rosgraph.get_master_uri()} does not tell what {robot} has "
                f"learned: {error}; start it again if it has ended"
            ) from None

    def change_map(self, path: Path) -> None:
        """Call the map server's service `change_map`; see `ClientLink.change_map`."""
        change_map(path)

    def _hear_place(self, robot: str, msg: Odometry) -> None:
        position = msg.pose.pose.position
        self._reports.put(HiveMessage(TruePlace(robot, position.x, position.y), 0.0))

    def _hear_battery(self, robot: str, msg: BatteryState) -> None:
        self._reports.put(HiveMessage(BatteryReading(robot, msg.voltage, msg.charge), 0.0))

    def _hear_collisions(self, msg: UInt32) -> None:
        self._reports.put(HiveMessage(Collisions(msg.data), 0.0))
