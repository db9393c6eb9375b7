# SPDX-License-Identifier: BSD-3-Clause
"""A robot goes on with its last good pose, whatever localization and base tell it."""

import math
from types import SimpleNamespace

import pytest

pytest.importorskip("rospy", reason="senses need ROS")

import rospy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry

from blackboard.ros.senses import Senses
from hive_common.pose import Pose


class Body:
    """A robot with a talker that hands on at once, and what both were told."""

    def __init__(self, monkeypatch):
        self.poses, self.ways, self.refused, self._hear = [], [], [], {}
        nothing = lambda *_: None  # noqa: E731  (a stub)
        monkeypatch.setattr(rospy, "Publisher", lambda *_, **__: None)
        monkeypatch.setattr(rospy, "get_param", lambda *_, **__: True)
        monkeypatch.setattr(
            rospy, "Subscriber", lambda topic, _, hear, **__: self._hear.update({topic: hear})
        )
        talker = SimpleNamespace(
            own="/robot1/",
            take=lambda _, handle: handle,
            refuse=lambda topic, _: self.refused.append(topic),
            world=SimpleNamespace(every=nothing),
        )
        robot = SimpleNamespace(set_pose=self.poses.append, add_travel=self.ways.append)
        Senses(talker, robot, None, 1.0).start()

    def hear(self, topic, kind, x, y, w):
        message = kind()
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.w = w
        self._hear[f"/robot1/{topic}"](message)


@pytest.fixture
def body(monkeypatch):
    return Body(monkeypatch)


@pytest.mark.parametrize(
    ("x", "w"), [(math.nan, 1.0), (1e308, 1.0), (2.0, 0.0), (2.0, 1e200), (2.0, math.inf)]
)
def test_a_pose_that_is_none_is_refused_and_counted_and_the_next_one_counts(body, x, w):
    body.hear("amcl_pose", PoseWithCovarianceStamped, x, 1.0, w)
    body.hear("amcl_pose", PoseWithCovarianceStamped, 3.0, 1.0, 1.0)

    assert body.refused == ["amcl_pose"]
    assert body.poses == [Pose(3.0, 1.0, 0.0)]


def test_a_quaternion_that_is_nearly_normalized_is_a_heading(body):
    body.hear("amcl_pose", PoseWithCovarianceStamped, 3.0, 1.0, 1.05)

    assert body.poses == [Pose(3.0, 1.0, 0.0)]


@pytest.mark.parametrize("odd", [math.nan, math.inf, 1e308])
def test_an_odd_place_of_the_base_is_no_way(body, odd):
    for x in (1.0, odd, 1.5):
        body.hear("odom", Odometry, x, 0.0, 1.0)

    assert body.refused == ["odom"]
    assert sum(body.ways) == 0.5


def test_a_base_that_sends_no_orientation_has_a_way_all_the_same(body):
    for x in (1.0, 1.5):
        body.hear("odom", Odometry, x, 0.0, 0.0)

    assert body.refused == []
    assert sum(body.ways) == 0.5
