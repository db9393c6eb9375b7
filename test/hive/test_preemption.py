# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives that get a task of the highest priority while all robots are busy."""

from dataclasses import replace

from blackboard.domain.characteristics import RobotState
from blackboard.domain.talker import TASK_ASSIGN
from blackboard.domain.task import StepKind, Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.network import Network
from hive_lab.virtual.task_checker import TaskChecker

LEFT, RIGHT = Pose(0.0, 0.0), Pose(50.0, 0.0)
URGENT = Task("U", TaskType.GA, (Pose(2.0, 3.0),), priority=10)
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def errand(name, near, priority=3):
    goals = (Pose(near.x + 4.0, 0.0), Pose(near.x + 8.0, 0.0))
    return Task(name, TaskType.GAB, goals, priority)


def carry(name, near):
    goals = (Pose(near.x + 4.0, 0.0), Pose(near.x + 8.0, 0.0))
    return Task(name, TaskType.GPAB, goals, 3, payload=2.0)


def busy_pair(left, right, after=3.0, network=None):
    """Return a hive with two robots at work, the left one near the urgent goal."""
    hive = Hive(network=network)
    TaskChecker(hive)
    hive.add_robot("left", LEFT)
    hive.add_robot("right", RIGHT)
    hive.post(left)
    hive.network.run(0.5)
    hive.post(right)
    hive.network.run(after)
    assert hive.robots["left"].status.task_id == left.id
    assert hive.robots["right"].status.task_id == right.id
    return hive


def test_the_robot_that_costs_least_to_interrupt_does_it_at_once():
    hive = busy_pair(errand("L", LEFT), errand("R", RIGHT))
    hive.post(URGENT)
    hive.network.run(1.0)

    assert hive.robots["left"].status.task_id == "U"
    assert hive.states("U")[-1] is STARTED
    assert hive.states("R") == [WAITING, ASSIGNED, STARTED]


def test_what_was_put_off_is_done_later_from_its_step_and_was_not_tried_in_vain():
    hive = busy_pair(errand("L", LEFT), errand("R", RIGHT), after=11.0)
    hive.post(URGENT)
    hive.network.run(90.0)

    record = hive.record("L")
    visited = [
        step.goal
        for command in hive.commands.values()
        for step in command.started
        if step.task_id == "L"
    ]
    assert hive.states("L") == [WAITING, ASSIGNED, STARTED, WAITING, ASSIGNED, STARTED, DONE]
    assert (record.tried, record.assignment) == ((), 2)
    assert visited.count(Pose(4.0, 0.0)) == 1


def test_the_reason_of_a_preemption_is_published():
    hive = busy_pair(errand("L", LEFT), errand("R", RIGHT))
    hive.post(URGENT)
    hive.network.run(1.0)

    (said,) = [update for update in hive.updates("L") if update.put_off_for]
    assert (said.state, said.robot_id, said.put_off_for) == (WAITING, "left", "U")
    assert "put it off for U" in said.reason


def test_whoever_is_cheapest_by_then_goes_on_with_it():
    hive = busy_pair(errand("L", LEFT), errand("R", RIGHT))
    hive.add_robot("idle", Pose(3.0, 0.0))
    hive.set_state("idle", "defect")
    hive.network.run(0.5)
    hive.post(URGENT)
    hive.network.run(1.0)
    hive.set_state("idle", "idle")
    hive.network.run(60.0)

    assert hive.record("U").robot == "left"
    assert hive.record("L").state is DONE


def test_an_idle_robot_does_it_and_nobody_is_interrupted():
    hive = busy_pair(errand("L", LEFT), errand("R", RIGHT))
    hive.add_robot("idle", Pose(90.0, 0.0))
    hive.post(URGENT)
    hive.network.run(30.0)

    assert hive.record("U").robot == "idle"
    assert hive.states("L") == [WAITING, ASSIGNED, STARTED, DONE]


def test_a_robot_with_its_load_on_board_is_not_interrupted_but_a_dearer_one_is():
    long = replace(errand("R", RIGHT), goals=(RIGHT,) * 9)
    hive = busy_pair(carry("L", LEFT), long, after=22.0)
    hive.post(URGENT)
    hive.network.run(1.0)

    assert hive.robots["left"].status.payload == 2.0
    assert hive.record("U").robot == "right"
    assert hive.states("L") == [WAITING, ASSIGNED, STARTED]


def test_where_all_carry_something_it_is_done_next():
    hive = busy_pair(carry("L", LEFT), carry("R", RIGHT), after=22.0)
    hive.post(URGENT)
    hive.network.run(1.0)
    order = hive.robots["left"].status.tasks
    hive.network.run(60.0)

    assert order == ("L", "U")
    assert hive.states("L") == [WAITING, ASSIGNED, STARTED, DONE]
    assert hive.record("U").state is DONE


def test_another_task_of_the_highest_priority_is_never_interrupted():
    hive = busy_pair(errand("L", LEFT, priority=10), errand("R", RIGHT, priority=10))
    hive.post(URGENT)
    hive.network.run(60.0)

    for name in ("L", "R"):
        assert hive.states(name) == [WAITING, ASSIGNED, STARTED, DONE]
    assert hive.record("U").state is DONE


def test_priority_9_interrupts_nobody():
    hive = busy_pair(errand("L", LEFT), errand("R", RIGHT))
    hive.post(replace(URGENT, priority=9))
    hive.network.run(60.0)

    assert hive.states("L") == [WAITING, ASSIGNED, STARTED, DONE]
    assert hive.states("R") == [WAITING, ASSIGNED, STARTED, DONE]


def test_a_robot_that_has_picked_since_it_bid_finishes_first():
    late = {}
    # The order is under way for as long as the robot needs to arrive and begin to pick.
    hive = busy_pair(
        carry("L", LEFT),
        carry("R", RIGHT),
        after=8.0,
        network=Network(
            lose=lambda topic, order: topic == TASK_ASSIGN and late.get(order.task.id)
        ),
    )
    late["U"] = True
    hive.post(URGENT)
    hive.network.run(2.5)
    late.clear()
    hive.network.run(90.0)

    assert hive.states("L") == [WAITING, ASSIGNED, STARTED, DONE]
    assert hive.record("U").state is DONE
    assert {
        command.started.count(s)
        for command in hive.commands.values()
        for s in command.started
        if s.kind is StepKind.PICK
    } == {1}


def test_a_robot_stops_its_drive_when_it_is_interrupted_and_is_idle_in_the_end():
    hive = Hive()
    hive.add_robot("left", LEFT)
    hive.post(errand("L", LEFT))
    hive.network.run(3.0)
    hive.post(URGENT)
    hive.network.run(1.0)
    at_once = hive.commands["left"].running
    hive.cancel("U")
    hive.network.run(1.0)
    then = hive.commands["left"].running
    hive.cancel("L")
    hive.network.run(1.0)

    assert (at_once.task_id, then.task_id) == ("U", "L")
    assert hive.robots["left"].state is RobotState.IDLE
