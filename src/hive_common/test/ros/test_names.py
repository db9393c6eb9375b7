# SPDX-License-Identifier: BSD-3-Clause
"""Where a robot's planned path is, by its parameter."""

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from hive_common.ros.names import RobotNames, plan_topic

ROBOT = RobotNames("/lab/", "robot5")


@pytest.fixture
def said(monkeypatch):
    lines = []
    monkeypatch.setattr(rospy, "logwarn", lines.append)
    return lines


def found(monkeypatch, given):
    monkeypatch.setattr(rospy, "get_param", {"/lab/robot5/plan_topic": given}.get)
    return plan_topic(ROBOT)


def test_without_the_parameter_it_is_that_of_our_move_base(monkeypatch, said):
    monkeypatch.setattr(rospy, "get_param", {}.get)

    assert plan_topic(ROBOT) == "/lab/robot5/move_base/plan"
    assert said == []


def test_a_name_is_below_the_robot_and_one_with_a_slash_in_front_is_where_it_says(
    monkeypatch, said
):
    assert found(monkeypatch, "planner/plan") == "/lab/robot5/planner/plan"
    assert found(monkeypatch, "/move_base/plan") == "/move_base/plan"
    assert said == []


@pytest.mark.parametrize("given", ["", "a b", "~plan", 7, "x" * 500 + "!"])
def test_what_no_topic_can_be_called_is_named_and_ours_is_taken(monkeypatch, said, given):
    assert found(monkeypatch, given) == "/lab/robot5/move_base/plan"
    (line,) = said
    assert line.startswith("/lab/robot5/plan_topic: ")
    assert "allowed: a topic, such as move_base/NavfnROS/plan" in line
    assert len(line) < 300
