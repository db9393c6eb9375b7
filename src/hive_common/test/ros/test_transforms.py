# SPDX-License-Identifier: BSD-3-Clause
"""Transforms go on when ROS time is set back."""

from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rosgraph
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped

from hive_common.ros.transforms import Transforms


@pytest.fixture
def clock(monkeypatch):
    """ROS time [s], as a list of one; nothing listens to a master."""
    time = [1000.0]
    monkeypatch.setattr(rospy, "get_time", lambda: time[0])
    monkeypatch.setattr(tf2_ros, "TransformListener", lambda _buffer: None)
    master = SimpleNamespace(lookupService=lambda _name: "another node has it")
    monkeypatch.setattr(rosgraph.masterapi, "Master", lambda _name: master)
    return time


def transform(x, stamp, child="robot1/odom"):
    """Return a transform from the map."""
    made = TransformStamped()
    made.header.frame_id, made.child_frame_id = "map", child
    made.header.stamp = rospy.Time.from_sec(stamp)
    made.transform.translation.x, made.transform.rotation.w = x, 1.0
    return made


def newest(transforms, child="robot1/odom"):
    """Return how far the newest transform goes."""
    return transforms.lookup_transform("map", child, rospy.Time(0)).transform.translation.x


def test_the_newest_transform_counts_also_after_time_was_set_back(clock):
    transforms = Transforms(5.0)
    transforms.set_transform(transform(1.0, 1000.0), "localization")
    clock[0] = 20.0
    transforms.set_transform(transform(2.0, 20.0), "localization")
    transforms.set_transform(transform(3.0, 20.1), "localization")

    assert newest(transforms) == 3.0


def test_a_fixed_transform_stays(clock):
    transforms = Transforms(5.0)
    transforms.set_transform_static(transform(0.3, 0.0, "robot1/laser"), "description")
    transforms.set_transform(transform(1.0, 1000.0), "localization")
    clock[0] = 20.0
    transforms.set_transform(transform(2.0, 20.0), "localization")

    assert newest(transforms, "robot1/laser") == 0.3
