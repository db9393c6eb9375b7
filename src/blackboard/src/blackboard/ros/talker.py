# SPDX-License-Identifier: BSD-3-Clause
"""The Talker on ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy

from blackboard.process.talker import ProcessTalker
from blackboard.ros.link import RosLink
from hive_common.ros.onward_clock import OnwardClock

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable


class RosTalker(ProcessTalker):
    """A talker of which ROS carries the messages. Make it after `rospy.init_node`.

    It advertises at once because ROS drops what is published before a subscriber has connected.

    Args:
        hive: Namespace of the hive, ending in a slash.
        advertises: The topics that may be published on.
        robots: The robots of this process. New subscribers of `robot_status` get the last status
            of each; the header of their connection names them in `robots`.

    ROS Publishers and Subscribers: as the core asks, with the types in `codec.tables.WIRES`.
    """

    def __init__(self, hive: str, advertises: Iterable[str], robots: Collection[str] = ()) -> None:
        super().__init__(hive, RosLink(hive, advertises, robots), RosRuntime())
        # Wakes `spin`, so that it sees the shutdown.
        rospy.on_shutdown(lambda: self.call(lambda: None))


class RosRuntime:
    """The clocks and the log of a node; see `process.talker.Runtime`.

    Attributes:
        simulated: ROS's time if `/use_sim_time` is set, which never goes back; else None.
    """

    def __init__(self) -> None:
        simulated = bool(rospy.get_param("/use_sim_time", default=False))
        self.simulated = OnwardClock(rospy.get_time).now if simulated else None

    def date(self) -> float:
        """Return ROS's time [s]."""
        return float(rospy.get_time())

    def warn(self, text: str) -> None:
        """Log a warning."""
        rospy.logwarn(text)

    def warn_seldom(self, text: str) -> None:
        """Log a warning; the same text at most every ten seconds."""
        rospy.logwarn_throttle_identical(10, text)

    def is_shutdown(self) -> bool:
        """Return whether the node is shut down."""
        return bool(rospy.is_shutdown())
