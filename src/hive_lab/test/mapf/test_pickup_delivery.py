# SPDX-License-Identifier: BSD-3-Clause
"""Pickup and delivery on a grid: who takes what, and that all is done without a meeting."""

import numpy as np
import pytest

from hive_lab.mapf.grid_file import Grid, TaskPlaces
from hive_lab.mapf.grid_paths import mistakes, steps_to
from hive_lab.mapf.pickup_delivery import Tasks, draw_tasks, serve
from hive_lab.mapf.step_planner import Pibt
from hive_lab.mapf.task_assignment import OpenTasks, assign

ROAD = Grid(np.ones((1, 8), dtype=bool))
HALL = Grid(np.ones((6, 8), dtype=bool))
HALL_PLACES = TaskPlaces(task=np.arange(8, 40), parking=np.arange(8))


def test_a_robot_alone_takes_the_way_to_pickup_and_delivery():
    places = TaskPlaces(task=np.array([3, 7]), parking=np.array([0]))
    tasks = Tasks(arrives=np.array([2]), pickup=np.array([3]), delivery=np.array([7]))
    served = serve(ROAD, places, tasks, 1, Pibt)

    assert (served.makespan, served.service_time, served.done) == (2 + 3 + 4, 7.0, True)
    assert served.paths[:, 0].tolist() == [0, 0, 0, 1, 2, 3, 4, 5, 6, 7]


@pytest.mark.parametrize("robots", [1, 4, 8])
@pytest.mark.parametrize("steps_per_plan", [1, 3])
def test_all_tasks_are_done_and_nobody_meets_anybody(robots, steps_per_plan):
    tasks = draw_tasks(HALL_PLACES, 40, frequency=0.5, seed=3)
    served = serve(HALL, HALL_PLACES, tasks, robots, Pibt, steps_per_plan)

    assert served.done
    assert list(mistakes(HALL, served.paths)) == []
    assert served.makespan >= tasks.arrives[-1]


def test_tasks_arrive_with_their_frequency_and_lead_to_another_place():
    tasks = draw_tasks(HALL_PLACES, 10, frequency=2.5, seed=1)

    assert tasks.arrives.tolist() == [0, 0, 0, 1, 1, 2, 2, 2, 3, 3]
    assert (tasks.pickup != tasks.delivery).all()


def test_robots_share_tasks_so_that_the_sum_of_ways_is_least():
    # The first robot is nearest to both, but the second one is far from the first task.
    steps = steps_to(ROAD, np.arange(8))
    tasks = OpenTasks(np.array([10, 11]), pickup=np.array([1, 4]), delivery=np.array([0, 5]))
    chosen = assign(steps, np.array([3, 7]), np.zeros(2), tasks, last=False)

    assert chosen.tolist() == [10, 11]


def test_a_robot_that_is_busy_for_long_leaves_a_task_to_one_farther_away():
    steps = steps_to(ROAD, np.arange(8))
    tasks = OpenTasks(np.array([5]), pickup=np.array([2]), delivery=np.array([0]))
    here = np.array([2, 7])

    assert assign(steps, here, np.array([4.0, 0.0]), tasks, last=False).tolist() == [5, -1]
    assert assign(steps, here, np.array([6.0, 0.0]), tasks, last=False).tolist() == [-1, 5]


def test_a_short_task_goes_first_while_more_are_to_come_and_a_long_one_at_the_end():
    steps = steps_to(ROAD, np.arange(8))
    tasks = OpenTasks(np.array([0, 1]), pickup=np.array([0, 0]), delivery=np.array([7, 1]))
    here, ready = np.array([0]), np.zeros(1)

    assert assign(steps, here, ready, tasks, last=False).tolist() == [1]
    assert assign(steps, here, ready, tasks, last=True).tolist() == [0]
