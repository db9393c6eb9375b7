# SPDX-License-Identifier: BSD-3-Clause
"""What robots announce to each other on `traffic`, as ROS messages."""

from __future__ import annotations

import math

import rospy
from geometry_msgs.msg import Point32
from robot_description.msg import Traffic
from std_msgs.msg import Header

from robot_navigation.traffic.right_of_way import Announcement, Right


def traffic_to_msg(said: Announcement, frame: str) -> Traffic:
    """Make a Traffic message of what a robot announces."""
    return Traffic(
        header=Header(stamp=rospy.Time.from_sec(said.time), frame_id=frame),
        name=said.name,
        way=[Point32(x, y, 0.0) for x, y in said.way],
        radius=said.radius,
        claim=said.claim,
        parked=said.parked,
        since=said.right.since,
        owner=said.right.owner,
        rank=said.right.step,
    )


def traffic_from_msg(msg: Traffic) -> Announcement:
    """Read a Traffic message.

    Raises:
        ValueError: It is not made of usable numbers.
    """
    numbers = [
        msg.radius,
        msg.claim,
        *(value for point in msg.way for value in (point.x, point.y)),
    ]
    if not (msg.way and msg.radius > 0 and msg.claim >= 0 and all(map(math.isfinite, numbers))):
        raise ValueError(f"traffic of {msg.name[:40]!r} has no way, or numbers that are none")
    way = tuple((point.x, point.y) for point in msg.way)
    return Announcement(
        name=msg.name,
        time=msg.header.stamp.to_sec(),
        x=way[0][0],
        y=way[0][1],
        radius=msg.radius,
        right=Right(msg.since, msg.owner, msg.rank, msg.name),
        way=way,
        claim=msg.claim,
        parked=msg.parked,
    )
