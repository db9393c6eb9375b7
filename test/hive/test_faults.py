# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives with one fault."""

from dataclasses import replace

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import (
    ROBOT_STATUS,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.network import Network
from hive_lab.virtual.task_checker import TaskChecker

GO = Task("T1", TaskType.GA, (Pose(5.0, 0.0),))
ROUND = Task("T1", TaskType.GAB, (Pose(5.0, 0.0), Pose(8.0, 0.0)))
CARRY = Task("T1", TaskType.GPAB, (Pose(5.0, 0.0), Pose(8.0, 0.0)), payload=3.0)
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def pair(network=None):
    """Return a hive with robot1 near all goals and robot2 far away."""
    hive = Hive(network=network)
    TaskChecker(hive)
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.add_robot("robot2", Pose(90.0, 0.0))
    return hive


def lose_first(topic, when=lambda _: True):
    """Return a rule that loses the first matching message of a topic."""
    left = [1]

    def lose(name, message):
        hit = bool(left) and name == topic and when(message)
        if hit:
            left.pop()
        return hit

    return lose


def test_a_robot_set_defect_under_way_has_its_task_done_by_another():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(12.0)
    hive.set_state("robot1", "defect")
    hive.network.run(60.0)

    assert hive.states("T1") == [WAITING, ASSIGNED, STARTED, WAITING, ASSIGNED, STARTED, DONE]
    assert hive.record("T1").robot == "robot2"
    assert hive.record("T1").tried == ("robot1",)
    # A had been visited already.
    assert [step.goal for step in hive.commands["robot2"].started] == [Pose(8.0, 0.0)]


def test_a_robot_set_defect_with_the_load_on_board_leaves_the_task_to_a_person():
    hive = pair()
    hive.post(CARRY)
    hive.network.run(25.0)
    hive.set_state("robot1", "defect")
    hive.network.run(60.0)

    assert hive.states("T1") == [WAITING, ASSIGNED, STARTED, FAILED]
    assert "take it off" in hive.record("T1").reason
    assert not hive.commands["robot2"].started


def test_a_robot_that_comes_back_into_service_takes_what_nobody_could():
    hive = Hive()
    hive.add_robot("robot1", Pose(0.0, 0.0))
    hive.set_state("robot1", "defect")
    hive.network.run(2.0)
    hive.post(GO)
    hive.network.run(2.0)
    waits = hive.record("T1").reason
    hive.set_state("robot1", "idle")
    hive.network.run(20.0)

    assert waits == "no robot is in service; what would help: robot1 back in service"
    assert hive.states("T1")[-1] is DONE


def test_a_task_of_a_kind_that_nobody_does_waits_until_a_robot_comes_that_can():
    hive = Hive()
    TaskChecker(hive)
    armless = replace(SMALL_ROBOT, arm_payload=0.0, capabilities=frozenset({TaskType.GA}))
    hive.add_robot("robot1", Pose(4.0, 0.0), armless)
    hive.post(CARRY)
    hive.network.run(10.0)
    waits = hive.record("T1").reason
    hive.add_robot("able", Pose(50.0, 0.0))
    hive.network.run(60.0)

    assert "does not do GPAB" in waits
    assert (hive.record("T1").state, hive.record("T1").robot) == (DONE, "able")


def test_a_robot_whose_drive_fails_hands_the_task_to_another():
    hive = pair()
    hive.commands["robot1"].results = [CommandResult(CommandState.ABORTED, "no way")] * 3
    hive.post(GO)
    hive.network.run(90.0)

    assert hive.record("T1").robot == "robot2"
    assert hive.record("T1").state is DONE


def test_a_task_that_fails_everywhere_is_given_up_with_the_reason():
    hive = pair()
    for command in hive.commands.values():
        command.results = [CommandResult(CommandState.ABORTED, "no way")] * 100
    hive.post(GO)
    hive.network.run(600.0)

    assert hive.record("T1").state is FAILED
    assert hive.record("T1").reason.startswith("given up after 5 tries, the last: robot")


def test_a_silent_robot_loses_its_task_to_another():
    hive = pair()
    hive.post(GO)
    hive.network.run(2.0)
    hive.kill("robot1")
    hive.network.run(60.0)

    assert hive.states("T1") == [WAITING, ASSIGNED, STARTED, WAITING, ASSIGNED, STARTED, DONE]
    record = hive.record("T1")
    assert (record.robot, record.tried) == ("robot2", ("robot1",))


def test_a_robot_whose_process_is_started_again_goes_on_with_its_task():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(12.0)
    hive.kill("robot1")
    hive.network.run(3.0)
    hive.add_robot("robot1", Pose(5.0, 0.0))
    hive.network.run(30.0)

    assert hive.record("T1").state is DONE
    assert [step.goal for step in hive.commands["robot1"].started] == [Pose(8.0, 0.0)]


def test_a_robot_without_network_stops_before_another_takes_its_task():
    hive = pair()
    hive.post(GO)
    hive.network.run(5.0)
    hive.talkers["robot1"].connected = False
    hive.network.run(4.0)
    stopped = hive.commands["robot1"].running is None
    meanwhile = hive.record("T1")
    hive.network.run(60.0)
    hive.talkers["robot1"].connected = True
    hive.network.run(5.0)

    assert stopped
    assert (meanwhile.state, meanwhile.robot) == (STARTED, "robot1")
    assert (hive.record("T1").state, hive.record("T1").robot) == (DONE, "robot2")
    assert hive.robots["robot1"].state is RobotState.IDLE


def test_other_tasks_go_on_while_a_robot_is_silent():
    hive = pair()
    hive.kill("robot1")
    hive.post(GO)
    hive.network.run(30.0)

    assert (hive.record("T1").state, hive.record("T1").robot) == (DONE, "robot2")


def test_a_cancelled_task_stops_its_robot():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(5.0)
    hive.cancel("T1")
    hive.network.run(30.0)

    assert hive.states("T1") == [WAITING, ASSIGNED, STARTED, CANCELLED]
    assert hive.robots["robot1"].state is RobotState.IDLE
    assert len(hive.commands["robot1"].started) == 1


def test_a_cancel_that_the_robot_did_not_hear_is_made_good_by_the_task_list():
    hive = pair(
        Network(lose=lose_first(TASK_ASSIGN, lambda order: order.kind is not OrderKind.ASSIGN))
    )
    hive.post(ROUND)
    hive.network.run(5.0)
    hive.cancel("T1")
    hive.network.run(30.0)

    assert len(hive.commands["robot1"].started) == 1
    assert hive.robots["robot1"].state is RobotState.IDLE


@pytest.mark.parametrize(
    ("topic", "when"),
    [
        (TASK_BROADCAST, lambda _: True),
        (TASK_COST, lambda _: True),
        (TASK_ASSIGN, lambda _: True),
        (TASK_STATE, lambda update: update.state is ASSIGNED),
        (TASK_STATE, lambda update: update.state is STARTED),
        (TASK_STATE, lambda update: update.state is DONE),
        (SYNC, lambda known: known.version > 0),
        (SYNC, lambda known: any(record.state is DONE for record in known.records)),
        (ROBOT_STATUS, lambda status: status.tasks),
        (ROBOT_STATUS, lambda status: not status.tasks),
    ],
)
def test_the_loss_of_any_one_message_delays_but_never_prevents_the_end_of_a_task(topic, when):
    hive = pair(Network(lose=lose_first(topic, when)))
    hive.post(GO)
    hive.network.run(60.0)
    said = len(hive.updates("T1"))
    hive.network.run(30.0)

    assert hive.record("T1").state is DONE
    assert len(hive.updates("T1")) == said


def test_after_two_failures_in_a_row_a_robot_repeats_no_report_for_ever():
    hive = Hive()
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.commands["robot1"].results = [CommandResult(CommandState.ABORTED, "no way")] * 6
    hive.post(GO)
    hive.network.run(120.0)

    states = [(update.state, update.assignment) for update in hive.updates("T1")]
    assert states == [
        (WAITING, 0),
        (ASSIGNED, 1),
        (STARTED, 1),
        (WAITING, 1),
        (WAITING, 1),
        (ASSIGNED, 2),
        (STARTED, 2),
        (WAITING, 2),
        (WAITING, 2),
        (ASSIGNED, 3),
        (STARTED, 3),
        (DONE, 3),
    ]
