# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives whose robots fall silent, come back, or make no progress."""

from dataclasses import replace

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import BACKUP, ROBOT_STATUS, SYNC, TASK_ASSIGN, TASK_STATE
from blackboard.domain.task import StepKind, Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.network import Network
from hive_lab.virtual.task_checker import TaskChecker

ROUND = Task("T1", TaskType.GAB, (Pose(5.0, 0.0), Pose(8.0, 0.0)))
CARRY = Task("T1", TaskType.GPAB, (Pose(5.0, 0.0), Pose(8.0, 0.0)), payload=3.0)
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def pair(network=None, **settings):
    """Return a hive with robot1 near all goals and robot2 far away."""
    hive = Hive(BlackboardSettings(**settings), network)
    TaskChecker(hive)
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.add_robot("robot2", Pose(90.0, 0.0))
    return hive


def goals(hive, robot):
    return [step.goal.x for step in hive.commands[robot].started if step.kind is StepKind.MOVE]


def unplug(hive, robot, *, connected=False):
    hive.talkers[robot].connected = connected


def test_another_robot_does_only_the_steps_that_are_left():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(12.0)
    hive.kill("robot1")
    hive.network.run(60.0)

    assert hive.record("T1").state is DONE
    assert goals(hive, "robot2") == [8.0]


def test_a_robot_stops_within_its_lease_and_waits():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(2.0)
    unplug(hive, "robot1")
    hive.network.run(3.6)

    status = hive.robots["robot1"].status
    assert hive.commands["robot1"].running is None
    assert (status.state, status.tasks) == (RobotState.BUSY, ("T1",))
    assert status.reason.startswith("stopped until the leader acknowledges")


def test_a_robot_that_is_back_in_time_goes_on_where_it_stopped():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(12.0)
    unplug(hive, "robot1")
    hive.network.run(4.0)
    unplug(hive, "robot1", connected=True)
    hive.network.run(30.0)

    assert hive.states("T1") == [WAITING, ASSIGNED, STARTED, DONE]
    assert goals(hive, "robot1") == [5.0, 8.0, 8.0]
    assert not hive.commands["robot2"].started


def test_a_robot_that_is_back_too_late_drops_what_is_not_its_own():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(2.0)
    unplug(hive, "robot1")
    hive.network.run(8.0)
    unplug(hive, "robot1", connected=True)
    hive.network.run(1.5)

    assert hive.record("T1").robot == "robot2"
    assert hive.robots["robot1"].status.tasks == ()
    assert len(hive.commands["robot1"].started) == 1


def test_a_robot_that_is_back_too_late_is_told_so_even_without_the_task_list():
    storm = {}
    hive = pair(Network(lose=lambda topic, _: bool(storm) and topic == SYNC))
    hive.post(ROUND)
    hive.network.run(2.0)
    unplug(hive, "robot1")
    hive.network.run(8.0)
    storm["lists"] = True
    unplug(hive, "robot1", connected=True)
    hive.network.run(1.5)

    assert hive.robots["robot1"].status.tasks == ()
    assert len(hive.commands["robot1"].started) == 1


def test_a_load_on_a_lost_robot_is_for_a_person_who_is_told_where():
    hive = pair()
    hive.post(CARRY)
    hive.network.run(25.0)
    hive.kill("robot1")
    hive.network.run(10.0)

    record = hive.record("T1")
    assert (record.state, record.robot) == (FAILED, "robot1")
    assert "last seen at (5.00, 0.00); the load of 3 kg may be on board" in record.reason
    assert not hive.commands["robot2"].started


def test_a_robot_that_comes_back_with_such_a_load_waits_for_the_person():
    hive = pair()
    hive.post(CARRY)
    hive.network.run(25.0)
    unplug(hive, "robot1")
    hive.network.run(10.0)
    unplug(hive, "robot1", connected=True)
    hive.network.run(3.0)

    status = hive.robots["robot1"].status
    assert (status.state, status.payload) == (RobotState.DEFECT, 3.0)
    assert "take it off" in status.reason


def test_nothing_is_picked_before_the_task_list_shows_the_arrival():
    storm = {}
    hive = pair(Network(lose=lambda topic, _: bool(storm) and topic == SYNC))
    hive.post(CARRY)
    hive.network.run(5.0)
    storm["lists"] = True
    hive.network.run(20.0)
    waits = [step.kind for step in hive.commands["robot1"].started]
    storm.clear()
    hive.network.run(60.0)

    assert waits == [StepKind.MOVE]
    assert hive.record("T1").state is DONE


def test_a_lost_robot_that_had_arrived_unheard_has_not_picked():
    hive = pair()
    hive.post(CARRY)
    hive.network.run(9.0)
    unplug(hive, "robot1")
    hive.network.run(80.0)

    assert [step.kind for step in hive.commands["robot1"].started] == [StepKind.MOVE]
    assert (hive.record("T1").state, hive.record("T1").robot) == (DONE, "robot2")


def test_with_wait_the_task_stays_with_its_robot_and_goes_on_when_it_is_back():
    hive = pair(on_robot_lost="wait")
    hive.post(ROUND)
    hive.network.run(2.0)
    unplug(hive, "robot1")
    hive.network.run(60.0)
    meanwhile, said = hive.record("T1"), len(hive.updates("T1"))
    unplug(hive, "robot1", connected=True)
    hive.network.run(2.0)
    back = hive.record("T1").reason
    hive.network.run(30.0)

    assert (meanwhile.state, meanwhile.robot) == (STARTED, "robot1")
    assert meanwhile.reason.startswith("waits for robot1 to come back")
    assert said == 4
    assert back == "robot1 is back"
    assert (hive.record("T1").state, hive.record("T1").robot) == (DONE, "robot1")


def test_with_wait_a_task_can_be_cancelled_while_its_robot_is_lost():
    hive = pair(on_robot_lost="wait")
    hive.post(ROUND)
    hive.network.run(2.0)
    unplug(hive, "robot1")
    hive.network.run(20.0)
    hive.cancel("T1")
    unplug(hive, "robot1", connected=True)
    hive.network.run(5.0)

    assert hive.record("T1").state is CANCELLED
    assert hive.robots["robot1"].status.tasks == ()
    assert len(hive.commands["robot1"].started) == 1


def test_with_operator_the_task_is_given_up_for_a_person():
    hive = pair(on_robot_lost="operator")
    hive.post(ROUND)
    hive.network.run(2.0)
    hive.kill("robot1")
    hive.network.run(10.0)

    assert hive.record("T1").state is FAILED
    assert "look how far it has come" in hive.record("T1").reason


def reports_lost():
    """Return a network that loses robot1's statuses while `storm` is not empty."""
    storm = {}

    def lose(topic, message):
        from_robot1 = getattr(message, "robot_id", "") == "robot1"
        return bool(storm) and from_robot1 and topic in {TASK_STATE, ROBOT_STATUS}

    return storm, Network(lose=lose)


def test_work_that_was_done_twice_is_believed_counted_and_shown():
    storm, network = reports_lost()
    hive = Hive(network=network)
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.add_robot("robot2", Pose(90.0, 0.0))
    hive.post(replace(ROUND, goals=(Pose(5.0, 0.0), Pose(8.0, 0.0))))
    hive.network.run(18.0)
    storm["robot1"] = True
    hive.network.run(8.0)
    storm.clear()
    hive.network.run(30.0)

    record = hive.record("T1")
    assert (record.state, record.robot) == (DONE, "robot1")
    assert record.reason == (
        "done by robot1 as well as by robot2; tasks with doubled work so far: 1"
    )
    assert hive.robots["robot2"].status.tasks == ()


def test_a_late_done_of_what_nobody_has_begun_again_is_no_doubled_work():
    storm, network = reports_lost()
    hive = Hive(network=network)
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.post(ROUND)
    hive.network.run(18.0)
    storm["robot1"] = True
    hive.network.run(8.0)
    waits = hive.record("T1").state
    storm.clear()
    hive.network.run(5.0)

    assert waits is WAITING
    assert (hive.record("T1").state, hive.record("T1").reason) == (DONE, "")
    assert goals(hive, "robot1") == [5.0, 8.0]


def stuck(hive, robot):
    """Make every further step of a robot take an hour."""
    hive.commands[robot].duration = lambda _: 3600.0


def test_a_robot_without_progress_hands_its_task_back_to_another():
    hive = pair()
    stuck(hive, "robot1")
    hive.post(ROUND)
    hive.network.run(60.0)
    before = hive.record("T1").state
    hive.network.run(60.0)

    record = hive.record("T1")
    assert before is STARTED
    assert (record.state, record.robot, record.tried) == (DONE, "robot2", ("robot1",))
    assert "robot1 made no progress within 89 s" in hive.updates("T1")[4].reason


def test_the_lease_stops_a_late_robot_that_ignores_orders():
    storm = {}
    hive = pair(Network(lose=lambda topic, _: bool(storm) and topic == TASK_ASSIGN))
    stuck(hive, "robot1")
    hive.post(ROUND)
    hive.network.run(5.0)
    storm["orders"] = True
    hive.network.run(89.0)
    halted = hive.commands["robot1"].running is None
    storm.clear()
    hive.network.run(60.0)

    assert halted
    assert (hive.record("T1").state, hive.record("T1").robot) == (DONE, "robot2")


def test_a_late_robot_with_its_load_on_board_says_where_it_is():
    hive = pair()
    hive.post(CARRY)
    hive.network.run(21.0)
    stuck(hive, "robot1")
    hive.network.run(120.0)

    assert hive.record("T1").state is FAILED
    assert "its load of 3 kg is on board at (8.00, 0.00)" in hive.record("T1").reason


def test_an_order_that_was_under_way_for_longer_than_a_lease_is_void():
    hive = pair()
    hive.post(ROUND)
    hive.network.run(2.0)
    (order,) = [m for topic, m in hive.network.sent if topic == TASK_ASSIGN]
    hive.cancel("T1")
    hive.network.run(4.0)
    hive.network.send(TASK_ASSIGN, replace(order, task=replace(ROUND, id="T9")))
    hive.network.run(1.0)

    assert hive.robots["robot1"].status.tasks == ()


@pytest.mark.parametrize("topic", [BACKUP, ROBOT_STATUS])
def test_one_second_without_a_topic_stops_no_robot(topic):
    storm = {}
    hive = pair(Network(lose=lambda name, _: bool(storm) and name == topic))
    hive.post(ROUND)
    hive.network.run(2.0)
    storm["now"] = True
    hive.network.run(1.0)
    storm.clear()
    hive.network.run(30.0)

    assert goals(hive, "robot1") == [5.0, 8.0]


def test_a_restarted_robot_goes_on_with_the_load_on_board_before_anything_else():
    hive = Hive()
    TaskChecker(hive)
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.post(CARRY, replace(ROUND, id="T2", priority=9))
    hive.network.run(3.0)
    first = hive.robots["robot1"].status.task_id
    hive.network.run(43.0)
    carries = hive.robots["robot1"].status.payload
    hive.post(replace(ROUND, id="T3", priority=9))
    hive.network.run(1.0)
    hive.add_robot("robot1", Pose(5.0, 0.0))
    hive.network.run(60.0)

    assert (first, carries) == ("T2", 3.0)
    assert [step.task_id for step in hive.commands["robot1"].started][:2] == ["T1", "T1"]
    assert hive.record("T3").state is DONE


def test_a_restarted_robot_leaves_what_it_has_begun_for_the_load_that_is_on_board():
    storm = {}
    hive = Hive(
        network=Network(
            lose=lambda topic, order: (
                bool(storm) and topic == TASK_ASSIGN and order.task.id == "T1"
            )
        )
    )
    hive.add_robot("robot1", Pose(4.0, 0.0))
    hive.post(CARRY)
    hive.network.run(25.0)
    hive.post(replace(ROUND, id="T2"))
    hive.network.run(1.0)
    storm["order"] = True
    hive.add_robot("robot1", Pose(5.0, 0.0))
    hive.network.run(1.0)
    storm.clear()
    hive.network.run(60.0)

    begun = [step.task_id for step in hive.commands["robot1"].started]
    assert begun == ["T2", "T1", "T1", "T2", "T2"]
    assert hive.record("T2").state is DONE


def test_a_dead_robots_task_moves_on_while_the_simulation_is_paused():
    hive = pair(Network(world_rate=0.0))
    hive.post(ROUND)
    hive.network.run(2.0)
    hive.kill("robot1")
    hive.network.run(8.0)

    assert hive.record("T1").robot == "robot2"


def test_a_robot_keeps_its_lease_while_the_simulation_is_paused():
    hive = pair(Network(world_rate=0.0))
    hive.post(ROUND)
    hive.network.run(30.0)

    assert hive.record("T1").robot == "robot1"
    assert not hive.robots["robot1"].status.reason


def test_a_fast_simulation_shortens_no_lease():
    hive = pair(Network(world_rate=3.0))
    hive.post(replace(ROUND, goals=(Pose(5.0, 0.0), Pose(60.0, 0.0))))
    hive.network.run(2.0)
    unplug(hive, "robot1")
    hive.network.run(2.0)
    working = hive.commands["robot1"].running is not None
    hive.network.run(1.6)

    assert working
    assert hive.commands["robot1"].running is None
