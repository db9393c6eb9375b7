# SPDX-License-Identifier: BSD-3-Clause
"""The paths that `move_base` plans for others, and what it forgets when it is asked to."""

from __future__ import annotations

import math
from typing import Any

import pytest

pytest.importorskip("rospy", reason="the node needs ROS")
pytest.importorskip("ompl")

import rospy
from nav_msgs.srv import GetPlanRequest
from std_srvs.srv import EmptyRequest

from hive_common.pose import Pose
from hive_common.ros.conversions import pose_to_msg


def plan(robot, goal: tuple[float, float], tolerance: float = 0.0, **start: Any) -> Any:
    """Ask for a plan, from where the robot is unless told; return its points."""
    request = GetPlanRequest(tolerance=tolerance)
    request.goal = pose_to_msg(Pose(*goal, 0.0), "map", rospy.Time(0))
    if start:
        request.start = pose_to_msg(Pose(start["x"], start["y"], 0.0), "map", rospy.Time(0))
    answer = robot.ask("/robot1/move_base/make_plan", request)
    return [(pose.pose.position.x, pose.pose.position.y) for pose in answer.plan.poses]


def test_a_plan_with_an_empty_start_begins_where_the_robot_is(robot) -> None:
    assert plan(robot, (8.0, 3.0)) == [(2.0, 2.0), (8.0, 3.0)]
    assert plan(robot, (8.0, 3.0), x=5.0, y=5.0)[0] == (5.0, 5.0)


def test_a_plan_with_an_empty_start_of_a_robot_that_is_lost_is_empty_and_says_why(
    robot,
) -> None:
    robot.pose = None

    assert plan(robot, (8.0, 3.0)) == []
    assert robot.warned == ["make_plan: nothing known"]


def test_a_plan_to_a_wall_ends_at_the_nearest_place_within_the_tolerance(robot) -> None:
    in_the_wall = (9.9, 5.0)

    far = plan(robot, in_the_wall, tolerance=0.3)
    near = plan(robot, in_the_wall, tolerance=1.0)

    room = robot.side - 0.2 - robot.model.base.circumscribed_radius - near[-1][0]
    assert far == []
    assert near[0] == (2.0, 2.0)
    assert 0.05 <= room < 0.11
    assert near[-1][1] == pytest.approx(5.0, abs=0.03)


def test_a_plan_off_the_map_ends_on_it_and_one_to_a_free_place_ends_there(robot) -> None:
    assert plan(robot, (12.0, 5.0), tolerance=3.0)[-1][0] < robot.side
    assert plan(robot, (8.0, 3.0), tolerance=3.0)[-1] == (8.0, 3.0)


@pytest.mark.parametrize("tolerance", [math.nan, -1.0])
def test_a_tolerance_that_is_none_counts_as_0(robot, tolerance: float) -> None:
    assert plan(robot, (9.9, 5.0), tolerance) == []
    assert plan(robot, (8.0, 3.0), tolerance)[-1] == (8.0, 3.0)


@pytest.mark.parametrize("again", [False, True])
def test_clear_costmaps_lets_the_robot_plan_through_what_is_gone(robot, again: bool) -> None:
    robot.send(8.0, 2.0)
    robot.drive(12.0, robot.measure_box)
    around = robot.published["/robot1/move_base/plan"][-1]

    robot.ask("/robot1/move_base/clear_costmaps", EmptyRequest())
    if again:
        robot.send(8.0, 2.0)
    robot.drive(1.0)

    straight = robot.published["/robot1/move_base/plan"][-1]
    assert len(around.poses) > 2
    assert len(straight.poses) == 2
