# SPDX-License-Identifier: BSD-3-Clause
"""Hosts several simulated robots in one process, with the names of nodes of their own.

Topics, actions, services, parameters and frames are those of the nodes that `robot.launch` starts
(docs/decisions/092); only the names of the nodes differ.
"""

from __future__ import annotations

import functools
import sys
import threading
import traceback
from typing import TYPE_CHECKING, Annotated

import attrs
import rospy
import tf2_ros

from blackboard.ros.guard_process import GuardProcess
from blackboard.ros.path_lengths import RosPathLengths
from blackboard.ros.robot_node import start_robot, topics_of
from blackboard.ros.startup import run_node
from blackboard.ros.transport import make_talker
from fleet_manager.config.fleet_file import LOCALIZATIONS, NAVIGATIONS
from hive_common.errors import HiveError
from hive_common.pose import Pose  # noqa: TC001  (structure reads it)
from hive_common.ros.loopback import hear_own_topics
from hive_common.ros.names import RobotNames
from hive_common.ros.params import structured
from hive_common.structuring import one_of
from hive_navigation.ros.amcl_node import Amcl
from hive_navigation.ros.fake_localization_node import FakeLocalization
from hive_navigation.ros.move_base_node import MoveBase
from hive_navigation.ros.position_announcer import PositionAnnouncer
from hive_navigation.ros.surroundings import Surroundings
from robot_description.ros.fixed_links import links_of
from simenv.ros.spawning import spawn_each

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.domain.settings import PathSettings

_SWITCH = 0.001
"""How long a thread keeps the interpreter while others want it [s]: a control round must not wait
for a whole message or bid of another robot, as it may with Python's 5 ms."""

_SPAWN_WITHIN = 120.0
"""Time to wait for the simulator [s, wall clock]."""


@attrs.frozen(kw_only=True)
class HostedRobot:
    """One robot of the parameter `~robots`."""

    name: str
    model: str
    pose: Pose  # where it starts, frame map
    localization: Annotated[str, one_of(*LOCALIZATIONS)]
    navigation: Annotated[str, one_of(*NAVIGATIONS)]


def main() -> None:
    """Run the robots until the node is shut down.

    ROS Parameters: `~robots`, a list with name, model, pose, localization and navigation of each;
        those of
        `robot_node`, `move_base` and `amcl` under the names that these nodes would have.
    """
    run_node("robot_host", _run)


def _run() -> None:
    sys.setswitchinterval(_SWITCH)
    hear_own_topics()
    hive = rospy.get_namespace()
    wanted = structured("~robots", tuple[HostedRobot, ...], [])
    robots = spawn_each(wanted, lambda each: (each.name, each.model, each.pose), _SPAWN_WITHIN)
    names = {robot.name: RobotNames(hive, robot.name) for robot in robots}
    broadcaster = tf2_ros.StaticTransformBroadcaster()
    broadcaster.sendTransform([link for each in names.values() for link in links_of(each)])
    surroundings = Surroundings(hive)
    for robot in robots:
        if robot.localization == "fake_localization":
            FakeLocalization(names[robot.name])
        elif robot.localization == "amcl":
            _in_thread(Amcl(names[robot.name], surroundings.map).run)
    for robot in robots:
        own = names[robot.name]
        if robot.navigation == "ours":
            MoveBase(own, surroundings).start()
        else:
            announcer = PositionAnnouncer(own, surroundings.transforms, surroundings.announce)
            surroundings.every(announcer.PERIOD, announcer.announce)
    _in_thread(surroundings.run)
    _join_hive(hive, list(names.values()))


def _join_hive(hive: str, robots: Sequence[RobotNames]) -> None:
    """Start the members of the robots, and run them until the node is shut down."""
    talker = make_talker(hive, topics_of(robots))

    @functools.cache
    def lengths(settings: PathSettings) -> RosPathLengths:
        return RosPathLengths(talker, hive, settings)

    guard = GuardProcess()
    for robot in robots:
        start_robot(talker, robot, lengths, guard)
    talker.spin()


def _in_thread(run: Callable[[], None]) -> None:
    """Run something beside the main thread; an error in it ends the process."""

    def run_to_the_end() -> None:
        try:
            run()
        except rospy.ROSInterruptException:
            return
        except Exception as error:  # noqa: BLE001  (whatever it is, half a host is no use)
            text = str(error) if isinstance(error, HiveError) else traceback.format_exc()
            rospy.logfatal(text)
            rospy.signal_shutdown(text)

    threading.Thread(target=run_to_the_end, daemon=True).start()
