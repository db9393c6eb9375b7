# SPDX-License-Identifier: BSD-3-Clause
"""What is said of a heavy task before it is posted, from what robots tell of themselves."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.auction.splitting import split
from blackboard.domain.bid import MAX_COST, Bid
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from fleet_manager.client.outlook import outlook
from hive_common.pose import Pose

HEAVY = Task("T7", TaskType.GA, (Pose(1.0, 1.0),), payload=500.0)


def robot(name, *carries, state=RobotState.IDLE):
    """Return the status of a robot; what it carries is for GA, GAB, GPA, GPAB [kg]."""
    return RobotStatus(name, state, Pose(0.0, 0.0), 1.0, carries=carries)


AGV = robot("robot1", 100.0, 100.0, -1.0, -1.0)
WITH_ARM = robot("robot2", 60.0, 60.0, 0.5, 0.5, state=RobotState.BUSY)


def test_a_task_that_will_be_split_is_told_with_the_number_of_its_parts():
    assert outlook(HEAVY, [WITH_ARM, AGV]) == (
        "no robot in service can carry 500 kg (robot1 carries most: 100 kg); "
        "the hive will split T7 into 5 parts"
    )


def test_what_an_arm_lifts_counts_for_a_pick():
    pick = replace(HEAVY, type=TaskType.GPA, payload=2.0)

    assert "(robot2 carries most: 0.5 kg); the hive will split T7 into 4 parts" in outlook(
        pick, [AGV, WITH_ARM]
    )


@pytest.mark.parametrize(
    ("task", "why"),
    [
        (
            replace(HEAVY, no_split=True),
            "(robot1 carries most: 100 kg), and it is not to be split",
        ),
        (replace(HEAVY, payload=10_001.0), "more than 100 parts of 100 kg"),
    ],
)
def test_a_task_that_cannot_be_split_is_told_to_wait(task, why):
    said = outlook(task, [AGV, WITH_ARM])

    assert said.startswith("T7 will wait: ")
    assert why in said


@pytest.mark.parametrize(
    "robots",
    [
        [],
        [AGV, robot("strong", 500.0, 500.0, -1.0, -1.0)],
        [AGV, robot("another make")],
        [robot("robot1", -1.0, 100.0, -1.0, -1.0)],
    ],
    ids=["no robot", "one can", "one does not tell", "none does such tasks"],
)
def test_nothing_is_said_where_nothing_is_split_or_nothing_is_certain(robots):
    assert outlook(HEAVY, robots) == ""


@pytest.mark.parametrize("state", [RobotState.DEFECT, RobotState.CHARGING, RobotState.OFFLINE])
def test_robots_out_of_service_do_not_count(state):
    strong = robot("strong", 500.0, 500.0, state=state)

    assert "into 5 parts" in outlook(HEAVY, [AGV, strong, robot("another make", state=state)])


@given(
    st.floats(0.1, 3000.0),
    st.lists(st.sampled_from([1.0, 12.5, 20.0, 100.0]), min_size=1, max_size=4),
)
def test_what_is_said_is_what_the_hive_does(payload, capacities):
    task = replace(HEAVY, payload=payload)
    names = [f"robot{number}" for number in range(len(capacities))]
    statuses = [
        robot(name, kg, kg, -1.0, -1.0) for name, kg in zip(names, capacities, strict=True)
    ]
    bids = [
        Bid(name, "T7", MAX_COST, most_payload=kg)
        for name, kg in zip(names, capacities, strict=True)
    ]
    said = outlook(task, statuses)
    if said.startswith("T7 will wait"):
        return

    records = split(TaskRecord(task), bids, frozenset(names), lambda _: False)

    assert said.endswith(f"the hive will split T7 into {len(records) - 1} parts") or not records
    assert bool(said) is bool(records)
