# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives whose leader improves the lists of tasks that have not begun."""

import pytest

from blackboard.costing.cost import measure_for
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.task_checker import TaskChecker

NEAR, FAR = Pose(5.0, 0.0), Pose(80.0, 0.0)
WAITING, ASSIGNED, STARTED, DONE, *_ = TaskState


def go(name, goal, priority=0):
    """Return a Go A task."""
    return Task(name, TaskType.GA, (goal,), priority)


def planned(model="latency"):
    """Return the settings of a fleet with a cost model."""
    return BlackboardSettings(decision="planned", improve_by=measure_for(model))


def hive_with_two_tasks():
    """Return a hive whose only robot works on one task and has another, far away, on its list."""
    hive = Hive(planned())
    TaskChecker(hive)
    hive.add_robot("robot1", Pose(0.0, 0.0), cost_model="latency")
    hive.post(go("near", NEAR), go("far", FAR))
    hive.network.run(1.0)
    return hive


def test_a_task_that_waits_in_a_list_goes_to_a_robot_that_joins_nearer_to_it():
    hive = hive_with_two_tasks()
    before = hive.record("far").robot
    hive.add_robot("robot2", Pose(79.0, 0.0), cost_model="latency")
    hive.network.run(60.0)

    assert before == "robot1"
    assert hive.record("far").robot == "robot2"
    assert hive.record("far").assignment == 2
    assert hive.record("far").tried == ()
    assert hive.states("far") == [WAITING, ASSIGNED, WAITING, ASSIGNED, STARTED, DONE]
    assert hive.states("near") == [WAITING, ASSIGNED, STARTED, DONE]


def test_a_gain_that_is_too_small_moves_nothing():
    hive = hive_with_two_tasks()
    hive.add_robot("robot2", Pose(1.4, 0.0), cost_model="latency")  # 2 s sooner there
    hive.network.run(9.0)

    assert hive.record("far").robot == "robot1"


def test_a_task_that_has_begun_stays_where_it_is():
    hive = hive_with_two_tasks()
    hive.network.run(10.0)
    hive.add_robot("robot2", Pose(79.0, 0.0), cost_model="latency")
    hive.network.run(60.0)

    assert hive.record("far").robot == "robot1"
    assert hive.states("far") == [WAITING, ASSIGNED, STARTED, DONE]


def test_the_tasks_of_two_robots_are_shared_with_a_third_and_all_are_done_once():
    hive = Hive(planned("makespan"))
    TaskChecker(hive)
    for name, x in (("robot1", 0.0), ("robot2", 40.0)):
        hive.add_robot(name, Pose(x, 0.0), cost_model="makespan")
    tasks = [go(f"T{number}", Pose(8.0 * number, 1.0)) for number in range(10)]
    hive.post(*tasks)
    hive.network.run(12.0)
    hive.add_robot("robot3", Pose(70.0, 0.0), cost_model="makespan")
    hive.network.run(120.0)

    assert all(hive.record(task.id).state is DONE for task in tasks)
    assert "robot3" in {hive.record(task.id).robot for task in tasks}


@pytest.mark.parametrize("model", ["report", "energy", "time", "makespan", "latency"])
def test_assignments_settle(model):
    hive = Hive(planned(model))
    TaskChecker(hive)
    for number in range(3):
        hive.add_robot(f"robot{number}", Pose(10.0 * number, 0.0), cost_model=model)
    tasks = [go(f"T{number}", Pose(float(number * 7 % 31), 2.0)) for number in range(12)]
    hive.post(*tasks)
    hive.network.run(600.0)

    assert all(hive.record(task.id).state is DONE for task in tasks)
    assert sum(hive.record(task.id).assignment for task in tasks) <= 2 * len(tasks)
