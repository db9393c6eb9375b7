# SPDX-License-Identifier: BSD-3-Clause
"""No task waits for ever."""

import pytest

from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.network import Network
from hive_lab.virtual.task_checker import TaskChecker

NEVER = 1e9
BEGUN = 1.8e9  # the date has nothing to do with the clocks of machines


@pytest.mark.parametrize(("aging", "is_done"), [(120.0, True), (NEVER, False)])
def test_a_long_task_is_done_although_short_ones_keep_coming(aging, is_done):
    hive = Hive(network=Network(begun=BEGUN))
    TaskChecker(hive)
    hive.add_robot("robot1", Pose(0.0, 0.0), cost_model="latency", aging=aging)
    hive.post(
        *(Task(f"N{n}", TaskType.GA, (Pose(1.0, float(n)),), posted=BEGUN) for n in range(2))
    )
    hive.post(Task("far", TaskType.GA, (Pose(100.0, 0.0),), posted=BEGUN))
    # Every step takes 10 s, so there is always a short task that waits.
    for number in range(150):
        hive.network.run(9.0)
        near = Pose(1.0, number % 3)
        hive.post(Task(f"T{number}", TaskType.GA, (near,), posted=BEGUN + hive.network.now))

    assert (hive.record("far").state is TaskState.DONE) == is_done
