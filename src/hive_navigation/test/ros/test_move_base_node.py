# SPDX-License-Identifier: BSD-3-Clause
"""The node `move_base` between what it hears and what it drives, answers and says."""

from __future__ import annotations

import math
from random import Random
from typing import Any

import pytest

pytest.importorskip("rospy", reason="the node needs ROS")
pytest.importorskip("ompl")

import numpy as np
from actionlib_msgs.msg import GoalStatusArray
from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import Float32
from std_srvs.srv import EmptyRequest

from hive_common.pose import Pose
from hive_lab.fuzz.mutations import Mutations, as_bytes
from hive_navigation.control.goal_tracker import NavigationSettings

BLIND = {
    "all unknown": {"ranges": np.full(360, math.nan, dtype=np.float32)},
    "no ranges": {"ranges": np.zeros(0, dtype=np.float32)},
    "all covered": {"ranges": np.zeros(360, dtype=np.float32)},
    "no angle between beams": {"angle_increment": 0.0},
    "no range": {"range_max": 0.0},
}


@pytest.mark.parametrize("fields", BLIND.values(), ids=BLIND)
def test_a_robot_whose_laser_goes_blind_stops_and_says_why(robot, fields: dict[str, Any]) -> None:
    robot.send(8.0, 2.0)
    assert robot.drive(3.0) > 0.3

    robot.drive(1.2, lambda: robot.measure(**fields))

    assert robot.velocity == (0.0, 0.0, 0.0)
    [wrong] = fields
    assert robot.warned[-1].startswith(f"no scan on /robot1/scan can be used: {wrong}: ")
    status = robot.published["/diagnostics"][-1].status[0]
    assert status.level == DiagnosticStatus.WARN
    assert status.message.startswith(f"a scan on /robot1/scan is skipped: {wrong}: ")


def test_a_single_bad_scan_does_not_stop_a_robot_but_is_counted(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)

    robot.drive(0.1, lambda: robot.measure(range_max=math.nan))
    way = robot.drive(0.5)

    assert way > 0.2
    assert robot.published["/diagnostics"][-1].status[0].values[0].value == "1"


def test_a_robot_whose_laser_sees_again_drives_on_and_tells_so(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)
    robot.drive(5.0, lambda: robot.measure(ranges=[]))

    assert robot.drive(2.0) > 0.3
    assert robot.published["/diagnostics"][-1].status[0].level == DiagnosticStatus.OK


def test_a_goal_of_a_robot_that_stays_blind_is_aborted_with_the_reason(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(1.0)

    robot.drive(33.0, lambda: robot.measure(ranges=[]))

    assert robot.server.outcome is not None
    state, text = robot.server.outcome
    assert state == "aborted"
    assert text.startswith("no scan on /robot1/scan can be used: ranges: 0; allowed: ")


def test_a_robot_whose_laser_dies_after_a_scan_from_the_future_stops(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)

    robot.now += 1000.0
    robot.measure()
    robot.now -= 1000.0
    robot.drive(2.0, lambda: None)

    assert robot.velocity == (0.0, 0.0, 0.0)


def test_a_robot_whose_localization_is_far_ahead_of_its_time_stops(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(3.0)

    robot.odd_transform = robot.transform_at(robot.now + 1000.0)
    robot.drive(0.5)

    assert robot.velocity == (0.0, 0.0, 0.0)


def test_a_speed_limit_that_is_not_a_number_changes_nothing(robot) -> None:
    robot.hear("/robot1/speed_limit", Float32(0.1))
    robot.send(8.0, 2.0)
    robot.drive(2.0)

    robot.hear("/robot1/speed_limit", Float32(math.nan))
    robot.drive(2.0)

    assert 0.0 < robot.velocity[0] <= 0.1 + 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_odd_messages_goals_and_requests_end_no_round_and_the_next_goal_is_reached(
    robot, seed: int
) -> None:
    random = Random(seed)
    mutations = Mutations(random, ["map", "robot1/base_footprint", "robot1/odom"])
    for _ in range(400):
        kind = random.choice(list(robot.good))
        message, what = mutations.mutate(as_bytes(robot.good[kind]), type(robot.good[kind]))
        try:
            robot.take(kind, message)
            robot.round()
        except Exception as error:
            raise AssertionError(f"{kind}: {what}") from error
        assert robot.failures == 0, f"{kind}: {what}: {robot.warned[-1]}"
        robot.odd_transform = None
        robot.drive(0.1)

    robot.pose = Pose(2.0, 2.0, 0.0)
    robot.hear("/robot1/speed_limit", Float32(0.0))
    robot.hear("/robot1/pick/status", GoalStatusArray())
    robot.ask("/robot1/move_base/clear_costmaps", EmptyRequest())
    robot.send(8.0, 2.0)
    robot.drive(30.0)
    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "succeeded"


def test_a_robot_drives_on_to_its_goal_when_the_clock_is_set_back(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(2.0)

    robot.set_clock_back(5.0)
    robot.drive(20.0)

    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "succeeded"


def test_a_robot_that_is_stuck_gives_up_in_time_also_when_the_clock_is_set_back(
    robot,
) -> None:
    robot.send(8.0, 2.0)
    robot.drive(2.0)
    robot.set_clock_back(5.0)
    stuck = robot.pose

    def hold() -> None:
        robot.pose = stuck
        robot.measure()

    robot.drive(NavigationSettings.give_up + 5.0, hold)

    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "aborted"


def test_a_robot_without_a_goal_stands_still_when_the_clock_is_set_back(robot) -> None:
    robot.drive(1.0)

    robot.set_clock_back(5.0)

    assert robot.drive(2.0) == 0.0


def test_a_robot_whose_scans_end_when_the_clock_is_set_back_stops(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(2.0)

    robot.set_clock_back(5.0)
    way = robot.drive(2.0, lambda: None)

    assert way < 0.3


def test_a_scan_is_recent_until_the_next_is_due_and_a_pose_as_long(robot) -> None:
    robot.measure()
    robot.odd_transform = robot.transform_at(99.9)
    robot.now += 0.05

    assert robot.recent_until == {
        "/robot1/scan": pytest.approx(100.0 + 1.0 / robot.model.laser.rate + 0.05),
        "robot1/base_footprint": pytest.approx(99.9 + 0.15),
    }


def test_a_scan_that_cannot_be_used_is_as_late_as_none(robot) -> None:
    robot.measure()
    before = robot.recent_until["/robot1/scan"]
    robot.now += 0.1
    robot.measure(range_max=math.nan)

    assert robot.recent_until["/robot1/scan"] == before


def test_nothing_is_late_of_a_robot_that_has_never_sensed_anything(robot) -> None:
    robot.pose = None

    assert robot.recent_until == {}


def test_a_transform_that_is_fixed_is_never_late(robot) -> None:
    robot.odd_transform = robot.transform_at(0.0)

    assert robot.recent_until == {}


def test_a_robot_says_at_once_that_it_has_a_goal_no_more(robot) -> None:
    robot.send(3.0, 2.0)
    robot.drive(0.5)
    assert robot.announced[-1].goal == (3.0, 2.0)

    while robot.server.outcome is None:
        robot.drive(0.1)

    assert (robot.announced[-1].goal, len(robot.announced[-1].path)) == (None, 1)


def test_an_idle_robot_announces_itself_twice_a_second(robot) -> None:
    robot.drive(5.0)

    assert len(robot.announced) == pytest.approx(10, abs=2)
