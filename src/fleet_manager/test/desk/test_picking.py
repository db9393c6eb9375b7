# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import math

from fleet_manager.desk.facts import Clicked
from fleet_manager.desk.picking import Filled, Picking
from hive_common.pose import Pose

BOTH = ("A", "B")


def click(x, y, frame="map"):
    return Clicked(Pose(x, y), frame, has_heading=False)


def drag(x, y, yaw):
    return Clicked(Pose(x, y, yaw), "map", has_heading=True)


def armed(name="A"):
    picking = Picking()
    picking.arm(name)
    return picking


def test_a_click_is_left_alone_while_no_goal_is_armed():
    assert Picking().take(click(1, 2), BOTH) is None


def test_a_click_fills_the_armed_goal_and_arms_the_next_one_needed():
    picking = armed()

    assert picking.take(click(1, 2), BOTH) == Filled("A", 1, 2)
    assert picking.armed == "B"


def test_after_the_last_goal_that_is_needed_clicks_are_left_alone():
    picking = armed("B")
    picking.take(click(1, 2), BOTH)

    assert picking.armed == ""
    assert picking.take(click(3, 4), BOTH) is None


def test_a_drag_fills_the_armed_goal_with_its_heading():
    assert armed().take(drag(1, 2, 0.5), BOTH) == Filled("A", 1, 2, 0.5)


def test_a_drag_from_where_the_click_was_sets_the_heading_of_that_goal():
    picking = armed()
    picking.take(click(1, 2), BOTH)

    assert picking.take(drag(1.2, 2.1, 0.5), BOTH) == Filled("A", yaw=0.5)
    assert picking.armed == "B"


def test_a_drag_from_elsewhere_fills_the_next_goal():
    picking = armed()
    picking.take(click(1, 2), BOTH)

    assert picking.take(drag(5, 5, 0.5), BOTH) == Filled("B", 5, 5, 0.5)


def test_the_heading_of_the_last_goal_can_still_be_set():
    picking = armed("B")
    picking.take(click(1, 2), BOTH)

    assert picking.take(drag(1, 2, 0.5), BOTH) == Filled("B", yaw=0.5)


def test_a_click_in_another_frame_fills_nothing_and_says_what_to_set():
    picking = armed()

    assert picking.take(click(1, 2, "robot1/odom"), BOTH) is None
    assert "robot1/odom" in picking.message
    assert picking.armed == "A"


def test_a_click_that_is_no_number_fills_nothing():
    assert armed().take(click(math.nan, 2), BOTH) is None


def test_an_optional_goal_can_be_picked_without_arming_another():
    picking = armed("C")

    assert picking.take(click(1, 2), BOTH) == Filled("C", 1, 2)
    assert picking.armed == ""


def test_a_drag_is_meant_for_a_goal_while_one_is_armed_or_near_the_last_click():
    picking = Picking()
    assert not picking.wants_drag(Pose(1, 2))

    picking.arm("B")
    assert picking.wants_drag(Pose(9, 9))

    picking.take(click(1, 2), BOTH)
    assert picking.wants_drag(Pose(1.2, 2.1))
    assert not picking.wants_drag(Pose(9, 9))
