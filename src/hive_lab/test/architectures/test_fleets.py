# SPDX-License-Identifier: BSD-3-Clause
"""Each architecture does its tasks, and shows what it is said to be."""

from dataclasses import replace

import pytest

from blackboard.domain.record import Order, OrderKind
from blackboard.domain.talker import ROBOT_STATUS, TASK_ASSIGN, TASK_BROADCAST, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_lab.architectures.central import DISPATCHER, CentralFleet, DispatchedRobot
from hive_lab.architectures.contract_net import ContractNet
from hive_lab.architectures.grounds import poses
from hive_lab.architectures.hall_trial import HallTrial
from hive_lab.architectures.kinds import ARCHITECTURES, report
from hive_lab.architectures.run import run
from hive_lab.architectures.trial import WARM_UP

HIVES = tuple(name for name, kind in ARCHITECTURES.items() if kind.is_hive)
GO = Task("T1", TaskType.GA, poses(1))


def said_on(trial, topic):
    """Note what is said on a topic from now on, each message with its sender."""
    said = []

    def note(sender, on, message):
        if on == topic:
            said.append((sender.name, message))

    trial.network.said = note
    return said


@pytest.mark.parametrize("architecture", ARCHITECTURES)
def test_every_architecture_does_every_task_once_if_nothing_goes_wrong(architecture):
    outcome = run(architecture, 4, "usual", seed=1)

    assert (outcome.not_done, outcome.done_twice, outcome.unanswered) == (0, 0, 0)
    assert len(outcome.ended) == len(outcome.posted)
    assert 0.0 < outcome.others <= outcome.busiest < outcome.all
    assert outcome.makespan == outcome.ended[-1]
    assert outcome.time_to_done < outcome.time_to_done_95 < outcome.makespan


@pytest.mark.parametrize("condition", ["killed", "loss"])
@pytest.mark.parametrize("architecture", HIVES)
def test_a_hive_does_every_task_once_whatever_goes_wrong(architecture, condition):
    outcome = run(architecture, 4, condition, seed=1)

    assert (outcome.not_done, outcome.done_twice, outcome.unanswered) == (0, 0, 0)


def test_what_a_dispatcher_has_not_given_out_dies_with_it():
    outcome = run("central", 4, "killed", seed=1)

    # Each robot still does the task that it has.
    assert 4 <= len(outcome.ended) < len(outcome.posted)
    assert outcome.unanswered > 0


def test_the_same_seed_gives_the_same_run():
    timeless = {"busiest": 0.0, "others": 0.0, "all": 0.0}

    first, second = (run("contract_net", 3, "loss", seed=2) for _ in range(2))

    assert first._replace(**timeless) == second._replace(**timeless)


def test_a_dispatched_robot_never_has_more_than_one_task():
    trial = HallTrial(3, seed=1)
    said = said_on(trial, ROBOT_STATUS)

    trial.begin(CentralFleet(trial))
    trial.network.run(WARM_UP + 200.0)

    lengths = {len(status.tasks) for _, status in said}
    assert lengths == {0, 1}


def test_a_robot_does_not_do_again_what_it_has_done_when_an_order_comes_late():
    trial = HallTrial(2, seed=1, posts=[(0.0, GO)])
    robot = trial.robots["robot1"]
    dispatcher = trial.boot(DISPATCHER)
    dispatcher.subscribe(TASK_STATE, lambda _: None)
    DispatchedRobot(robot, trial.boot("robot1"), trial.path_lengths()(0.3), "latency").start()
    said = said_on(trial, TASK_STATE)
    order = Order(GO, "robot1", assignment=1, hive=DISPATCHER)

    dispatcher.publish(TASK_ASSIGN, order)
    trial.network.run(200.0)
    dispatcher.publish(TASK_ASSIGN, replace(order, kind=OrderKind.FORGOTTEN))
    trial.network.run(201.0)
    count = len(said)
    dispatcher.publish(TASK_ASSIGN, order)
    trial.network.run(400.0)

    assert len(trial.ledger.done["T1"]) == 1
    assert [update.state for _, update in said[count:]] == [TaskState.DONE]


def test_the_tasks_of_a_dispatched_robot_that_died_go_to_others():
    trial = HallTrial(4, seed=1)
    trial.begin(CentralFleet(trial))
    trial.network.run(WARM_UP + 5.0)
    given_to = []
    trial.network.said = lambda _sender, topic, order: (
        given_to.append(order.robot_id) if topic == TASK_ASSIGN else None
    )

    trial.kill("robot1")
    trial.network.run(WARM_UP + 15.0)
    given_to.clear()
    trial.network.run(WARM_UP + 1000.0)

    assert trial.ledger.is_all_done
    assert "robot1" not in given_to


def test_whoever_got_a_task_calls_for_bids_on_it():
    trial = HallTrial(4, seed=1)
    said = said_on(trial, TASK_BROADCAST)

    trial.begin(ContractNet(trial))
    trial.network.run(WARM_UP + 60.0)

    assert all(sender == call.hive for sender, call in said)
    assert len({sender for sender, _ in said}) > 1
    assert all(len(call.tasks) == 1 for _, call in said)


def test_managers_auction_the_tasks_of_a_robot_that_died_again():
    trial = HallTrial(4, seed=1)
    fleet = ContractNet(trial)
    trial.begin(fleet)
    trial.network.run(WARM_UP + 30.0)
    managers = [each for name, each in fleet.managers.items() if name != "robot1"]

    def held():
        return [record.task.id for each in managers for record in each.book.held_by("robot1")]

    before = held()
    trial.kill("robot1")
    trial.network.run(WARM_UP + 45.0)

    assert before
    assert not held()


def test_a_robot_of_the_report_puts_what_it_is_given_at_the_end_of_its_list():
    trial = HallTrial(2, seed=1)
    said = said_on(trial, ROBOT_STATUS)

    trial.begin(report(trial))
    trial.network.run(WARM_UP + 200.0)

    for robot in trial.robots:
        before = ()
        for _, status in said:
            if status.robot_id == robot:
                kept = tuple(task for task in before if task in status.tasks)
                assert status.tasks[: len(kept)] == kept
                before = status.tasks
        assert before or trial.ledger.done
