# SPDX-License-Identifier: BSD-3-Clause
"""What is said before all robots use another map."""

from dataclasses import replace

import numpy as np

from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.new_map import PlacedRobot, of_changing_map
from hive_common.grid_map import GridMap
from hive_common.pose import Pose

SMALL = PlacedRobot("robot2", Pose(1.0, 2.0), 0.2)
WIDE = PlacedRobot("robot10", Pose(1.0, 1.0), 0.4)
PLACES = {"dock": Pose(3.0, 2.0), "shelf": Pose(1.0, 3.0)}
TO_DOCK = TaskRecord(Task("T1", TaskType.GAB, (PLACES["shelf"], PLACES["dock"])))


def hall(gap=4.0):
    """Return a hall of 4 m x 4 m with a wall in its middle that leaves a gap [m]."""
    blocked = np.zeros((80, 80), dtype=bool)
    blocked[: round((4.0 - gap) / 0.05), 40] = True
    return GridMap.of_blocked(blocked, 0.05)


def said(grid, *robots, records=()):
    return of_changing_map(grid, robots or (SMALL, WIDE), PLACES, records)


def test_where_everything_stays_within_reach_nothing_is_said():
    assert said(hall(), records=[TO_DOCK]) == []


def test_places_out_of_reach_are_named_for_the_robots_that_are_too_wide():
    assert said(hall(gap=0.7), records=[TO_DOCK]) == ["robot10 cannot reach dock"]


def test_tasks_that_no_robot_can_do_any_more_are_named_with_their_goals():
    done = replace(TO_DOCK, state=TaskState.DONE)

    assert said(hall(gap=0.0), records=[TO_DOCK, done]) == [
        "robot2, robot10 cannot reach dock",
        "no robot reaches (3.00, 2.00) of task T1",
    ]


def test_a_robot_that_stands_in_a_wall_of_the_map_or_off_it_is_named_and_asked_for_no_places():
    lost = SMALL._replace(pose=Pose(9.0, 1.0))
    in_wall = WIDE._replace(pose=Pose(2.02, 1.0))

    first, second = said(hall(gap=2.0), lost, in_wall)
    assert first.startswith("robot2 stands at (9.00, 1.00), which is outside the map")
    assert second.startswith("robot10 stands at (2.02, 1.00), which is inside a wall")


def test_where_no_robot_is_known_nothing_can_be_said():
    assert of_changing_map(hall(gap=0.0), (), PLACES, [TO_DOCK]) == []


def test_cells_that_are_probably_free_are_free_as_they_are_for_robots():
    shades = np.full((80, 80), 20, dtype=np.int8)
    shades[:, 40] = 60

    assert said(GridMap(shades, 0.05)) == ["robot2, robot10 cannot reach dock"]
