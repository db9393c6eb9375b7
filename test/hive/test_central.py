# SPDX-License-Identifier: BSD-3-Clause
"""Hives that decide centrally do the same as hives whose robots bid."""

import random

import pytest

from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import TASK_ASSIGN, TASK_COST
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.task_checker import TaskChecker


def place(draw):
    """Return a random place."""
    return Pose(draw.uniform(0.0, 60.0), draw.uniform(0.0, 60.0))


def run(decision, seed, cost_model):
    """Return a hive of some robots and tasks after every task is done."""
    draw = random.Random(seed)
    hive = Hive(BlackboardSettings(decision=decision))
    TaskChecker(hive)
    for number in range(draw.randint(2, 5)):
        hive.add_robot(f"robot{number}", place(draw), cost_model=cost_model)
    names = [f"T{number}" for number in range(12)]
    for name in names:
        kind = draw.choice(list(TaskType))
        goals = (place(draw), place(draw))
        hive.post(Task(name, kind, goals, draw.choice([0, 5, 10]), draw.choice([0.0, 4.0])))
        hive.network.run(draw.choice([0.0, 0.0, 7.0]))
    hive.network.run(30.0)
    hive.set_state("robot0", "defect")
    hive.network.run(400.0)
    return hive, names


@pytest.mark.parametrize("cost_model", ["report", "time", "latency"])
@pytest.mark.parametrize("seed", range(3))
def test_the_same_orders_are_given_in_the_same_order_at_the_same_times(seed, cost_model):
    bidding, names = run("distributed", seed, cost_model)
    central, _ = run("centralized", seed, cost_model)
    orders = [
        [message for topic, message in hive.network.sent if topic == TASK_ASSIGN]
        for hive in (bidding, central)
    ]
    answers = [message for topic, message in central.network.sent if topic == TASK_COST]

    assert orders[0] == orders[1]
    left = [each for each in map(bidding.record, names) if each.state is not TaskState.DONE]
    assert all(each.state is TaskState.FAILED and "on board" in each.reason for each in left)
    assert answers
    assert all(answer.basis and not answer.bids for answer in answers)
