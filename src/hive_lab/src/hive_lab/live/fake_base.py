# SPDX-License-Identifier: BSD-3-Clause
"""A fake base: moves a robot of a real hive that runs without a world.

    python3 -m hive_lab.live.fake_base /robot1 0.5 2.0

runs one in a process of its own: the robot's namespace, the duration of each drive [s], and where
the robot starts (x [m]). From SIGUSR1 to SIGUSR2 no drive arrives.
"""

from __future__ import annotations

import signal
import threading
import time
from typing import Any

import actionlib
import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseResult
from nav_msgs.msg import Path

from hive_common.ros import action_servers
from hive_common.ros.signals import init_node

_LOOK_EVERY = 0.02  # time between two checks for a cancelled goal [s]


class FakeBase:
    """A robot's localization, and a `move_base` that arrives anywhere after a while.

    Create it after `rospy.init_node`. It starts at `x` [m], with y = 0.

    Attributes:
        seconds: Duration of the next drives [s].
        fails: Whether the next drives abort instead of arriving.
        arrivals: Goals reached so far, x [m] and y [m].
        begun: Number of drives begun.
        cancelled: Number of drives that were cancelled.
        held: Whether no drive arrives now, however long it has lasted.

    ROS Actions: server of `move_base` (move_base_msgs/MoveBaseAction).
    ROS Publishers: `amcl_pose` (geometry_msgs/PoseWithCovarianceStamped) and `move_base/plan`
        (nav_msgs/Path, the goal alone), latched.
    """

    def __init__(self, namespace: str, seconds: float = 0.1, x: float = 0.0) -> None:
        self.seconds = seconds
        self.fails = False
        self.arrivals: list[tuple[float, float]] = []
        self.begun = 0
        self.cancelled = 0
        self.held = False
        self._cancelled = 0
        self._pose = rospy.Publisher(
            f"{namespace}/amcl_pose", PoseWithCovarianceStamped, latch=True, queue_size=1
        )
        self._plan = rospy.Publisher(f"{namespace}/move_base/plan", Path, latch=True, queue_size=1)
        self._say_pose(x, 0.0)
        self._server = actionlib.SimpleActionServer(
            f"{namespace}/move_base", MoveBaseAction, self._drive, auto_start=False
        )
        action_servers.start(self._server)

    def cancel_all(self) -> None:
        """End the current drive, as a base that loses power does."""
        self._cancelled += 1

    def _drive(self, goal: Any) -> None:  # noqa: ANN401  (a MoveBaseGoal)
        self.begun += 1
        self._plan.publish(Path(goal.target_pose.header, [goal.target_pose]))
        run = self._cancelled
        end = time.monotonic() + self.seconds
        while (left := end - time.monotonic()) > 0 or self.held:
            given_up = run != self._cancelled or rospy.is_shutdown()
            if given_up or self._server.is_preempt_requested():
                self.cancelled += 1
                self._server.set_preempted()
                return
            threading.Event().wait(min(left, _LOOK_EVERY) if left > 0 else _LOOK_EVERY)
        if self.fails:
            self._server.set_aborted(text="the fake base was told to fail")
            return
        place = goal.target_pose.pose.position
        self.arrivals.append((place.x, place.y))
        self._say_pose(place.x, place.y)
        self._server.set_succeeded(MoveBaseResult())

    def _say_pose(self, x: float, y: float) -> None:
        self._pose.publish(pose_message(x, y))


def pose_message(x: float, y: float) -> PoseWithCovarianceStamped:
    """Return a pose at x [m], y [m] without a turn, frame map."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "map"
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.w = 1.0
    return message


def main() -> None:
    """Serve one robot until the node is shut down."""
    namespace, seconds, x = rospy.myargv()[1:4]
    init_node("fake_base", anonymous=True)
    base = FakeBase(namespace, float(seconds), float(x))
    signal.signal(signal.SIGUSR1, lambda *_: setattr(base, "held", True))
    signal.signal(signal.SIGUSR2, lambda *_: setattr(base, "held", False))
    rospy.spin()


if __name__ == "__main__":
    main()
