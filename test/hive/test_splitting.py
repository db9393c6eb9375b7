# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives that get tasks which no robot can carry alone."""

from dataclasses import replace

import pytest

from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.task_checker import TaskChecker

HEAVY = Task("T7", TaskType.GAB, (Pose(5.0, 0.0), Pose(8.0, 0.0)), priority=4, payload=36.0)
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def team(*payloads):
    """Return a hive with a robot for each payload [kg]."""
    hive = Hive()
    TaskChecker(hive)
    for number, payload in enumerate(payloads, start=1):
        kind = replace(SMALL_ROBOT, payload=payload)
        hive.add_robot(f"robot{number}", Pose(4.0, float(number)), kind)
    return hive


def parts(hive):
    """Return (state, payload) of the parts."""
    found = []
    while True:
        try:
            record = hive.record(f"T7.{len(found) + 1}")
        except StopIteration:
            return found
        found.append((record.state, record.task.payload))


def test_two_robots_carry_it_side_by_side():
    hive = team(20.0, 20.0)
    hive.post(HEAVY)
    hive.network.run(15.0)
    together = {robot.status.task_id for robot in hive.robots.values()}
    hive.network.run(30.0)

    assert together == {"T7.1", "T7.2"}
    assert parts(hive) == [(DONE, 18.0), (DONE, 18.0)]
    assert hive.states("T7") == [WAITING, ASSIGNED, STARTED, DONE]


def test_each_robot_gets_what_it_can_carry():
    hive = team(30.0, 10.0)
    hive.post(HEAVY)
    hive.network.run(45.0)

    assert parts(hive) == [(DONE, 27.0), (DONE, 9.0)]
    assert {hive.record("T7.1").robot, hive.record("T7.2").robot} == {"robot1", "robot2"}


def test_one_robot_goes_several_times():
    hive = team(20.0)
    hive.post(HEAVY)
    hive.network.run(60.0)

    assert parts(hive) == [(DONE, 18.0), (DONE, 18.0)]
    assert hive.record("T7").state is DONE


def test_what_an_arm_has_to_lift_is_split_by_what_arms_lift():
    hive = team(20.0)
    hive.post(replace(HEAVY, type=TaskType.GPAB, payload=12.0))
    hive.network.run(150.0)

    assert parts(hive) == [(DONE, 4.0)] * 3
    assert hive.record("T7").state is DONE


def test_the_whole_shows_how_far_it_is():
    hive = team(20.0)
    hive.post(HEAVY)
    hive.network.run(25.0)

    said = hive.updates("T7")[-1]
    assert (said.state, said.step, said.steps) == (STARTED, 1, 2)
    assert said.reason == "1 of 2 parts done"


def test_whoever_can_carry_it_alone_does():
    hive = team(20.0, 40.0)
    hive.post(HEAVY)
    hive.network.run(30.0)

    assert (hive.record("T7").state, hive.record("T7").robot) == (DONE, "robot2")
    assert parts(hive) == []


def test_a_strong_robot_that_is_only_too_empty_is_waited_for():
    hive = team(20.0)
    hive.add_robot("empty", Pose(4.0, 0.0), replace(SMALL_ROBOT, payload=90.0), charge=0.05)
    hive.post(HEAVY)
    hive.network.run(10.0)

    assert parts(hive) == []
    assert hive.record("T7").state is WAITING
    assert "its charge would fall" in hive.record("T7").reason


def test_to_cancel_the_whole_cancels_its_parts_and_stops_the_robots():
    hive = team(20.0, 20.0)
    hive.post(HEAVY)
    hive.network.run(5.0)
    hive.cancel("T7")
    hive.network.run(2.0)

    assert hive.record("T7").state is CANCELLED
    assert [state for state, _ in parts(hive)] == [CANCELLED, CANCELLED]
    assert all(command.running is None for command in hive.commands.values())
    assert all(robot.status.tasks == () for robot in hive.robots.values())


def test_the_whole_fails_with_a_part_and_the_others_go_on():
    hive = team(20.0, 20.0)
    hive.commands["robot1"].results = [CommandResult(CommandState.ABORTED, "no way")] * 99
    hive.post(replace(HEAVY, type=TaskType.GPAB, payload=10.0))
    hive.network.run(12.0)
    hive.commands["robot1"].results = []
    hive.network.run(1.0)
    hive.cancel("T7.1")
    hive.network.run(200.0)

    assert hive.states("T7")[-1] is FAILED
    assert "its part T7.1 was cancelled" in hive.record("T7").reason
    assert hive.record("T7.2").state is DONE


def test_a_part_that_became_too_heavy_is_split_again():
    hive = team(30.0, 10.0)
    hive.post(HEAVY)
    hive.network.run(2.0)
    hive.set_state("robot1", "defect")
    hive.network.run(300.0)

    assert hive.record("T7.1").parts == 3
    assert hive.record("T7.1.3").parent == "T7.1"
    assert hive.record("T7").state is DONE


def test_a_whole_that_was_done_by_a_robot_that_comes_back_ends_its_parts():
    hive = team(20.0, 20.0)
    hive.add_robot("strong", Pose(4.0, 0.0), replace(SMALL_ROBOT, payload=90.0))
    hive.post(HEAVY)
    hive.network.run(19.5)
    hive.talkers["strong"].connected = False
    hive.network.run(8.0)
    split = hive.record("T7").parts
    hive.talkers["strong"].connected = True
    hive.network.run(3.0)

    assert split == 2
    assert (hive.record("T7").state, hive.record("T7").robot) == (DONE, "strong")
    assert [state for state, _ in parts(hive)] == [CANCELLED, CANCELLED]
    assert all(robot.status.tasks == () for robot in hive.robots.values())


@pytest.mark.parametrize("payload", [2001.0, 1e6])
def test_what_takes_too_many_parts_waits_and_says_so(payload):
    hive = team(20.0)
    hive.post(replace(HEAVY, payload=payload))
    hive.network.run(3.0)

    assert hive.record("T7").state is WAITING
    assert "more than 100 parts" in hive.record("T7").reason


def test_a_part_takes_no_id_from_another_task():
    hive = team(20.0)
    hive.post(Task("T7.2", TaskType.GA, (Pose(1.0, 1.0),)))
    hive.network.run(1.0)
    hive.post(HEAVY)
    hive.network.run(3.0)

    assert parts(hive) == []
    assert "the id T7.2 of a part is taken" in hive.record("T7").reason
