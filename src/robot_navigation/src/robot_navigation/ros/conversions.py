# SPDX-License-Identifier: BSD-3-Clause
"""Converts what robots announce on `traffic`; only the message calls the path `way`."""

from __future__ import annotations

import math

import rospy
from geometry_msgs.msg import Point32
from robot_description.msg import Traffic
from std_msgs.msg import Header

from robot_navigation.traffic.right_of_way import Announcement, Right


def traffic_to_msg(announcement: Announcement, frame: str) -> Traffic:
    """Return an announcement as a message."""
    right = announcement.right
    return Traffic(
        header=Header(stamp=rospy.Time.from_sec(announcement.time), frame_id=frame),
        name=announcement.name,
        way=[Point32(x, y, 0.0) for x, y in announcement.path],
        radius=announcement.radius,
        claim=announcement.claim,
        parked=announcement.stationary,
        since=right.since,
        owner=right.owner,
        rank=right.step,
    )


def traffic_from_msg(msg: Traffic) -> Announcement:
    """Return the announcement in a message; raise ValueError if its numbers cannot be used."""
    path = tuple((point.x, point.y) for point in msg.way)
    numbers = [msg.radius, msg.claim, *(value for point in path for value in point)]
    if not (path and msg.radius > 0 and msg.claim >= 0 and all(map(math.isfinite, numbers))):
        raise ValueError(
            f"traffic of {msg.name[:40]!r} is ignored: it needs a way of finite numbers, "
            "a radius above 0 and a claim of at least 0"
        )
    return Announcement(
        name=msg.name,
        time=msg.header.stamp.to_sec(),
        x=path[0][0],
        y=path[0][1],
        radius=msg.radius,
        right=Right(msg.since, msg.owner, msg.rank, msg.name),
        path=path,
        claim=msg.claim,
        stationary=msg.parked,
    )
