# SPDX-License-Identifier: BSD-3-Clause
"""What an operator's request brings with it."""

from dataclasses import replace

import pytest

from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.consequences import of_cancelling
from hive_common.pose import Pose

CARRY = Task("T1", TaskType.GPAB, (Pose(1, 2), Pose(3, 4)), payload=2.0)
BEGUN = TaskRecord(CARRY, TaskState.STARTED, "robot3")


@pytest.mark.parametrize(
    ("kind", "step", "words"),
    [
        (TaskType.GPAB, 0, ""),
        (TaskType.GPAB, 1, "may be picking"),
        (TaskType.GPAB, 2, "carries"),
        (TaskType.GPAB, 3, "carries"),
        (TaskType.GPA, 1, "may be picking"),
        (TaskType.GAB, 1, ""),
    ],
)
def test_only_a_load_that_an_arm_has_taken_is_left_on_board(kind, step, words):
    told = of_cancelling([replace(BEGUN, task=replace(CARRY, type=kind), step=step)])

    assert len(told) == bool(words)
    assert all(f"robot3 {words} the load of T1 (2 kg)" in each for each in told)


def test_a_task_that_waits_or_was_split_leaves_nothing_on_board():
    waits = TaskRecord(CARRY, TaskState.ASSIGNED, "robot3")
    split = TaskRecord(CARRY, TaskState.STARTED, step=2, parts=4)

    assert of_cancelling([waits, split]) == []
