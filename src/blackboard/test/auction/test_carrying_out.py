# SPDX-License-Identifier: BSD-3-Clause
"""What a plan asks for: awards, transfers and other places."""

from dataclasses import replace

from blackboard.auction.carrying_out import steps_to
from blackboard.auction.search.planned import Place, Planned
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

FLEET = frozenset({"robot1", "robot2"})


def record(name, robot=""):
    """Return the record of a task that waits, or that a robot has and has not begun."""
    task = Task(name, TaskType.GA, (Pose(1.0, 0.0),))
    state = TaskState.ASSIGNED if robot else TaskState.WAITING
    return TaskRecord(task, state, robot)


def planned(*places, was=None):
    """Return a plan of (record, robot, place)."""
    return Planned(tuple(Place(*each, eta=5.0) for each in places), was=was or {})


def steps(plan, in_service=FLEET):
    """Return what a plan asks for if nothing has changed since."""
    return steps_to(plan, {each.record.task.id: each.record for each in plan.places}, in_service)


def test_what_waits_is_awarded_at_its_place():
    found = steps(planned((record("T1"), "robot2", 3)))

    assert [(bid.task_id, bid.robot_id, bid.eta) for bid in found.awards] == [
        ("T1", "robot2", 5.0)
    ]
    assert found.places == {"T1": 3}


def test_what_another_robot_has_is_moved():
    found = steps(planned((record("T1", "robot1"), "robot2", 2)))

    assert [(move.records[0].task.id, move.place) for move in found.moves] == [("T1", 2)]
    assert not found.awards


def test_a_list_in_the_order_of_the_plan_is_left_alone():
    first, second = record("T1", "robot1"), record("T2", "robot1")
    plan = planned((first, "robot1", 1), (second, "robot1", 2), was={"robot1": ("T1", "T2")})

    assert steps(plan).reorders == ()


def test_a_list_in_another_order_is_ordered_anew():
    first, second = record("T1", "robot1"), record("T2", "robot1")
    plan = planned((second, "robot1", 1), (first, "robot1", 2), was={"robot1": ("T1", "T2")})

    assert steps(plan).reorders == ((second, 1), (first, 2))


def test_what_has_changed_while_the_plan_was_made_is_left_out():
    plan = planned((record("T1"), "robot1", 1))
    changed = replace(plan.places[0].record, state=TaskState.CANCELLED)

    assert steps_to(plan, {"T1": changed}, FLEET).awards == ()


def test_a_robot_that_has_left_service_gets_nothing():
    assert steps(planned((record("T1"), "robot1", 1)), frozenset({"robot2"})).awards == ()
