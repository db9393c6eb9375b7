# SPDX-License-Identifier: BSD-3-Clause
"""Which tasks are offered again, and which of them change hands."""

from blackboard.cost import MAX_COST, Bid
from blackboard.improving import Improving, moved
from blackboard.pose import Pose
from blackboard.record import TaskRecord
from blackboard.task import Task, TaskState, TaskType

BOTH = frozenset({"robot1", "robot2"})


def held(name, robot, state=TaskState.ASSIGNED, tried=()):
    """Return the record of a task on a robot's list."""
    task = Task(name, TaskType.GA, (Pose(1.0, 1.0),))
    return TaskRecord(task, state, robot, assignment=1, tried=tried)


def offer(record, **costs):
    """Return an offer with what the robots bid on it."""
    return record, [Bid(robot, record.task.id, cost, eta=1.0) for robot, cost in costs.items()]


def names(records):
    """Return the ids of some tasks."""
    return [record.task.id for record in records]


def improving(*records, threshold=0.1):
    """Return what chooses among some records, and what it has recalled."""
    recalled = []
    return Improving(lambda: records, recalled.append, threshold), recalled


def test_a_task_moves_to_the_robot_that_it_costs_less():
    assert names(moved([offer(held("T1", "robot1"), robot1=10.0, robot2=5.0)], 0.1)) == ["T1"]


def test_a_task_stays_where_it_gains_no_more_than_the_threshold():
    assert moved([offer(held("T1", "robot1"), robot1=10.0, robot2=9.0)], 0.1) == []
    assert names(moved([offer(held("T1", "robot1"), robot1=10.0, robot2=8.9)], 0.1)) == ["T1"]


def test_two_tasks_are_swapped():
    offers = [
        offer(held("T1", "robot1"), robot1=10.0, robot2=2.0),
        offer(held("T2", "robot2"), robot1=3.0, robot2=9.0),
    ]

    assert names(moved(offers, 0.1)) == ["T1", "T2"]


def test_no_robot_gets_two():
    offers = [
        offer(held("T1", "robot1"), robot1=10.0, robot2=1.0, robot3=9.0),
        offer(held("T3", "robot3"), robot1=20.0, robot2=2.0, robot3=8.0),
    ]

    # One of them to robot2: T1 there gains 9, T3 there gains 6.
    assert names(moved(offers, 0.1)) == ["T1"]


def test_a_task_that_its_own_robot_does_not_bid_on_stays():
    assert moved([offer(held("T1", "robot1"), robot1=MAX_COST, robot2=1.0)], 0.1) == []
    assert moved([offer(held("T1", "robot1"), robot2=1.0)], 0.1) == []


def test_a_robot_that_cannot_or_has_tried_in_vain_gets_nothing():
    assert moved([offer(held("T1", "robot1"), robot1=900.0, robot2=MAX_COST)], 0.1) == []
    record = held("T1", "robot1", tried=("robot2",))
    assert moved([offer(record, robot1=10.0, robot2=1.0)], 0.1) == []


def test_nothing_offered_nothing_moved():
    assert moved([], 0.1) == []


def test_one_task_of_each_robot_is_offered_another_in_each_step_then_it_rests():
    chooser, _ = improving(held("T1", "robot1"), held("T2", "robot1"), held("T3", "robot2"))

    offered = [names(chooser.offers(BOTH, 100)) for _ in range(3)]

    assert offered == [["T2", "T3"], ["T1", "T3"], []]


def test_of_a_large_fleet_others_offer_in_each_step_until_all_have():
    chooser, _ = improving(
        held("T1", "robot1"), held("T2", "robot1"), held("T3", "robot2"), held("T4", "robot3")
    )
    robots = frozenset({"robot1", "robot2", "robot3"})

    offered = [names(chooser.offers(robots, 2)) for _ in range(5)]

    assert offered[4] == []
    assert {name for step in offered for name in step} == {"T1", "T2", "T3", "T4"}
    assert all(0 < len(step) <= 2 for step in offered[:4])


def test_after_a_change_it_is_offered_again():
    chooser, _ = improving(held("T1", "robot1"))
    chooser.offers(BOTH, 100)
    rests = chooser.offers(BOTH, 100) == []
    chooser.note_change()

    assert rests
    assert names(chooser.offers(BOTH, 100)) == ["T1"]


def test_what_has_begun_is_not_offered_nor_what_a_robot_out_of_service_has():
    chooser, _ = improving(
        held("T1", "robot1", TaskState.STARTED), held("T2", "robot3"), held("T3", "robot2")
    )

    assert names(chooser.offers(BOTH, 100)) == ["T3"]


def test_a_lone_robot_offers_nothing():
    chooser, _ = improving(held("T1", "robot1"))

    assert chooser.offers(frozenset({"robot1"}), 100) == []


def test_what_is_to_move_is_recalled_and_that_is_no_try_in_vain():
    record, other = held("T1", "robot1"), held("T2", "robot2")
    chooser, recalled = improving(record, other)

    chooser.decide([offer(record, robot1=10.0, robot2=5.0)])

    assert names(recalled) == ["T1"]
    assert chooser.has_recalled(record)
    assert not chooser.has_recalled(other)
