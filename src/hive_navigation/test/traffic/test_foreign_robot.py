# SPDX-License-Identifier: BSD-3-Clause
import itertools
import math

import pytest

from hive_common.pose import Pose
from hive_navigation.traffic.foreign_robot import ForeignRobot
from hive_navigation.traffic.right_of_way import Announcement, meetings, no_right
from robot_description.models import load_model

BASE = load_model("mir100").base


@pytest.fixture
def robot():
    return ForeignRobot("guest", BASE)


def test_a_robot_that_stands_announces_where_it_stands_and_moves_aside_for_nobody(robot):
    robot.announcement(1.0, Pose(3.0, 2.0, 0.5))
    said = robot.announcement(1.2, Pose(3.0, 2.001, 0.5))

    assert (said.path, said.claim, said.stationary) == (((3.0, 2.001),), 0.0, True)
    assert said.radius == pytest.approx(BASE.circumscribed_radius)
    assert (said.time, said.yaw, said.goal) == (1.2, 0.5, None)


def test_a_robot_that_moves_claims_what_it_needs_to_stop_straight_ahead(robot):
    robot.announcement(1.0, Pose(3.0, 2.0))
    said = robot.announcement(1.2, Pose(3.2, 2.0))
    length = sum(math.dist(*leg) for leg in itertools.pairwise(said.path))

    assert said.path[-1][1] == pytest.approx(2.0)
    assert said.path[-1][0] > 3.2 + 1.0 / (2 * BASE.acceleration)
    assert said.claim == pytest.approx(length)


def test_a_corrected_pose_is_not_taken_for_a_speed_that_the_robot_does_not_reach(robot):
    robot.announcement(1.0, Pose(3.0, 2.0))
    leap = robot.announcement(1.2, Pose(9.0, 2.0))
    brake = BASE.max_speed**2 / (2 * BASE.acceleration)

    assert leap.claim <= brake + 0.5 * BASE.max_speed + 0.31


def test_after_a_pause_nothing_is_said_of_the_speed(robot):
    robot.announcement(1.0, Pose(3.0, 2.0))

    assert robot.announcement(9.0, Pose(9.0, 2.0)).claim == 0.0


def test_the_clock_may_be_set_back(robot):
    robot.announcement(5.0, Pose(3.0, 2.0))

    assert robot.announcement(1.0, Pose(3.5, 2.0)).claim == 0.0


def test_others_stop_before_its_claim_and_do_not_ask_it_to_move(robot):
    robot.announcement(1.0, Pose(3.0, 2.0))
    said = robot.announcement(1.2, Pose(3.2, 2.0))
    way = ((8.0, 2.0), (0.0, 2.0))
    me = Announcement("me", 1.2, 8.0, 2.0, 0.5, no_right("me"), way, 0.0, stationary=False)

    (meeting,) = meetings(me, [said])

    assert meeting.room < 8.0 - said.path[-1][0] - 0.5
    assert not meeting.blocks_it
