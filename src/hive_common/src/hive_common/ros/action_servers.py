# SPDX-License-Identifier: BSD-3-Clause
"""Starts servers of actionlib so that they go on when ROS time is set back.

The timer with which actionlib 1.14 publishes a server's status ends with an exception when time is
set back, and nothing tells. Clients take the server for dead then.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy

if TYPE_CHECKING:
    import actionlib


def start(server: actionlib.ActionServer | actionlib.SimpleActionServer) -> None:
    """Start a server, with a timer that goes on."""
    server.start()
    inner = getattr(server, "action_server", server)
    if inner.status_frequency > 0.0:
        inner.status_timer.shutdown()
        period = rospy.Duration.from_sec(1.0 / inner.status_frequency)
        inner.status_timer = rospy.Timer(period, inner.publish_status_async, reset=True)
