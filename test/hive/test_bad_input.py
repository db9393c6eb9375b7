# SPDX-License-Identifier: BSD-3-Clause
"""A working hive survives bursts and absurd numbers; `test_fuzz` tries everything else."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blackboard.board.intake import why_refused
from blackboard.costing.bid_basis import Bids
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.bid import Bid
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import Order, OrderKind, TaskUpdate
from blackboard.domain.talker import (
    NEW_TASK,
    ROBOT_STATUS,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.domain.validation import MAX_NAME
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive

HUGE = "x" * 10_000_000
NUMBERS = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e308, 5e-324)


@pytest.fixture
def hive():
    """A hive with one robot on its way to a task called `real`."""
    hive = Hive()
    hive.add_robot("robot1", Pose(0.0, 0.0, 0.0))
    hive.post(Task("real", TaskType.GAB, (Pose(1.0, 0.0, 0.0), Pose(2.0, 0.0, 0.0))))
    hive.network.run(1.0)
    return hive


def test_a_hive_handles_a_burst_of_a_thousand_messages(hive):
    for number in range(1000):
        hive.network.send(
            NEW_TASK, Task(f"burst{number % 5}", TaskType.GA, (Pose(4.0, 0.0, 0.0),))
        )
    hive.network.run(600.0)

    assert {hive.record(f"burst{n}").state for n in range(5)} == {TaskState.DONE}


def test_an_unknown_robot_wins_no_auction(hive):
    hive.network.listen(
        TASK_BROADCAST,
        lambda said: hive.network.send(
            TASK_COST,
            Bids(
                "ghost",
                said.epoch,
                said.auction,
                tuple(Bid("ghost", task.id, 0.0, 0.0, 0.0) for task, _ in said.tasks),
            ),
        ),
    )
    hive.post(Task("next", TaskType.GA, (Pose(5.0, 0.0, 0.0),)))
    hive.network.run(120.0)

    assert hive.record("next").robot == "robot1"
    counts = hive.talkers["blackboard"].refusals.counts
    assert counts[TASK_COST, "no robot 'ghost' has been heard"] >= 1


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_is_rejected_by_name(number):
    status = RobotStatus("robot1", RobotState.IDLE, Pose(number, 0.0, 0.0), 1.0)

    assert why_refused(ROBOT_STATUS, status) == (
        f"RobotStatus.pose ({number:g}, 0, 0) is not made of finite numbers"
    )


@pytest.mark.parametrize("number", [1e308, -1e308, 3.5e38, 1e13])
def test_a_number_with_which_one_cannot_calculate_is_rejected_by_name(number):
    far = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, number, 0.0), 1.0)
    heavy = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, 0.0, 0.0), 1.0, payload=number)

    assert "is farther from the origin than 100 km" in why_refused(ROBOT_STATUS, far)
    assert f"RobotStatus.payload is {number}; allowed: " in why_refused(ROBOT_STATUS, heavy)


ABSURD = (*NUMBERS, 3.5e38, -1e308, 1e13, 1e5, -0.0)
"""Finite numbers that overflow in the arithmetic of cells or of messages, and the others."""


@pytest.mark.parametrize("number", ABSURD)
@pytest.mark.parametrize("field", ["x", "y", "yaw", "payload", "posted"])
def test_a_task_with_one_absurd_number_ends_no_member_and_the_next_task_is_done(number, field):
    hall = GridMap.of_blocked(np.zeros((60, 100), dtype=bool), 0.1)
    hive = Hive(path_lengths=GridPathLengths(hall))
    hive.add_robot("robot1", Pose(1.0, 1.0, 0.0), path_lengths=GridPathLengths(hall, 0.3))
    hive.network.run(1.0)
    numbers = {"x": 2.0, "y": 2.0, "yaw": 0.0, "payload": 0.0, "posted": 0.0} | {field: number}
    goal = Pose(numbers["x"], numbers["y"], numbers["yaw"])
    hive.network.send(
        NEW_TASK,
        Task("odd", 0, (goal,), payload=numbers["payload"], posted=numbers["posted"]),
    )
    hive.network.run(60.0)
    hive.post(Task("next", TaskType.GA, (Pose(3.0, 3.0, 0.0),)))
    hive.network.run(60.0)

    assert hive.record("next").state is TaskState.DONE
    assert hive.updates("odd")  # it is answered, whatever the answer


def test_a_text_of_ten_megabytes_is_refused_by_its_length():
    update = TaskUpdate("T1", TaskState.DONE, robot_id=HUGE)

    assert why_refused(TASK_STATE, update) == (
        f"TaskUpdate.robot_id has 10000000 characters; allowed: at most {MAX_NAME}"
    )


def test_an_order_for_a_task_of_unknown_type_is_refused():
    order = Order(Task("T1", 77, (Pose(0.0, 0.0, 0.0),)), "robot1")

    assert "type 77 is unknown" in why_refused(TASK_ASSIGN, order)
    assert "type 77 is unknown" in why_refused(
        TASK_ASSIGN, Order(Task("T1", 77, ()), "robot1", OrderKind.TAKE_BACK)
    )


@pytest.mark.parametrize("task_is_over", [False, True])
def test_a_robot_that_holds_a_task_by_a_forged_order_takes_tasks_again(hive, task_is_over):
    hive.add_robot("robot2", Pose(40.0, 0.0, 0.0))
    hive.network.run(60.0 if task_is_over else 1.0)
    order = next(said for topic, said in hive.network.heard if topic == TASK_ASSIGN)
    now = hive.network.now
    hive.network.send(
        TASK_ASSIGN, replace(order, robot_id="robot2", assignment=1_000_000, heard=now)
    )
    hive.network.run(60.0)
    hive.post(Task("next", TaskType.GA, (Pose(41.0, 0.0, 0.0),)))
    hive.network.run(60.0)

    assert (hive.record("next").state, hive.record("next").robot) == (TaskState.DONE, "robot2")
