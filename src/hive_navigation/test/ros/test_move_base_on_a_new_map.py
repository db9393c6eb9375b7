# SPDX-License-Identifier: BSD-3-Clause
"""What `move_base` does when another map is served, or zones close."""

from __future__ import annotations

import pytest

pytest.importorskip("rospy", reason="the node needs ROS")
pytest.importorskip("ompl")


from hive_common.grid_map import GridMap
from hive_common.map_id import checksum_of
from hive_common.pose import STOP
from hive_common.zone import NO_STOPPING, Zone


def with_a_shelf(hall):
    """Return the hall with a shelf across its middle, 2 m short of its upper wall."""
    blocked = hall.blocked.copy()
    blocked[:160, 95:105] = True
    return GridMap.of_blocked(blocked, 0.05)


def test_a_robot_under_way_plans_anew_on_a_new_map_and_reaches_its_goal(robot) -> None:
    robot.send(8.0, 2.0)
    robot.drive(1.0)
    before = robot.published["/robot1/move_base/plan"][-1].poses
    robot.change_map(with_a_shelf(robot.hall))
    robot.drive(1.0)
    after = robot.published["/robot1/move_base/plan"][-1].poses
    robot.drive(60.0)

    assert max(pose.pose.position.y for pose in before) < 2.5
    assert max(pose.pose.position.y for pose in after) > 8.0
    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "succeeded"


def test_a_goal_that_a_new_map_cuts_off_is_aborted_and_a_robot_without_one_stays(
    robot,
) -> None:
    wall = robot.hall.blocked.copy()
    wall[:, 95:105] = True
    robot.change_map(with_a_shelf(robot.hall))
    assert robot.drive(1.0) == 0.0

    robot.send(8.0, 2.0)
    robot.drive(1.0)
    robot.change_map(GridMap.of_blocked(wall, 0.05))
    robot.drive(15.0)

    assert robot.server.outcome is not None
    assert robot.server.outcome[0] == "aborted"
    assert robot.velocity == STOP


def test_move_base_tells_which_map_it_uses(robot) -> None:
    robot.change_map(with_a_shelf(robot.hall))

    told = [(each.node, each.checksum) for each in robot.published["/robot1/map_in_use"]]
    assert told == [
        ("move_base", checksum_of(robot.hall)),
        ("move_base", checksum_of(with_a_shelf(robot.hall))),
    ]


def test_a_robot_under_way_plans_around_a_zone_that_is_closed(robot) -> None:
    across = ((4.5, 0.0), (5.5, 0.0), (5.5, 6.0), (4.5, 6.0))
    robot.send(8.0, 2.0)
    robot.drive(1.0)
    robot.change_zones(Zone(name="middle", kind=NO_STOPPING, corners=across, closed=True))
    robot.drive(1.0)
    after = robot.published["/robot1/move_base/plan"][-1].poses

    assert max(pose.pose.position.y for pose in after) > 6.0
