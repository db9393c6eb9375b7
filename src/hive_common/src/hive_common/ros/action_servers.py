# SPDX-License-Identifier: BSD-3-Clause
"""Starts servers of actionlib so that they go on when ROS time is set back, and end without noise.

The timer with which actionlib 1.14 publishes a server's status ends with an exception when time is
set back, and nothing tells. Clients take the server for dead then. And it prints a traceback when
it is due while the node is shut down.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import rospy

from hive_common.ros.signals import is_shutting_down

if TYPE_CHECKING:
    import actionlib
    from rospy.timer import TimerEvent


def start(server: actionlib.ActionServer | actionlib.SimpleActionServer) -> None:
    """Start a server, with a timer that goes on."""
    server.start()
    inner = getattr(server, "action_server", server)
    if inner.status_frequency > 0.0:
        inner.status_timer.shutdown()
        period = rospy.Duration.from_sec(1.0 / inner.status_frequency)
        inner.status_timer = rospy.Timer(period, partial(_tell_status, inner), reset=True)


def _tell_status(server: actionlib.ActionServer, event: TimerEvent) -> None:
    try:
        server.publish_status_async(event)
    except rospy.ROSException:
        if not is_shutting_down():
            raise
