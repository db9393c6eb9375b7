# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives that get tasks which no robot can carry alone."""

from dataclasses import replace

import pytest

from blackboard.board.unsplitting import MOST_ATTEMPTS
from blackboard.domain.record import OrderKind
from blackboard.domain.settings import DECISIONS, BlackboardSettings
from blackboard.domain.talker import TASK_ASSIGN, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.network import Network
from hive_lab.virtual.task_checker import TaskChecker

HEAVY = Task("T7", TaskType.GAB, (Pose(5.0, 0.0), Pose(8.0, 0.0)), priority=4, payload=36.0)
REASSIGN = BlackboardSettings().reassign
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def team(*payloads, settings=None, network=None):
    """Return a hive with a robot for each payload [kg]."""
    hive = Hive(settings, network)
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
    assert said.reason == (
        "split into 2 parts of 18 kg, because robot1 carries most, 20 kg; 1 of 2 parts done"
    )


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
    assert "its charge could fall" in hive.record("T7").reason


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


def queued(*payloads, task=HEAVY, network=None):
    """Return a hive in which T7 is split, and its parts wait behind T0 on robots' lists."""
    hive = team(*payloads, network=network)
    for number in range(len(payloads)):
        way = 40.0 * (-1) ** number
        hive.post(Task(f"T0-{number}", TaskType.GA, (Pose(way, float(number)),)))
    hive.network.run(3.0)
    hive.post(task)
    hive.network.run(3.0)
    return hive


def keep_busy(hive, tasks, kind=TaskType.GA):
    """Post tasks that go before the parts of T7."""
    for number in range(tasks):
        hive.post(Task(f"T9-{number}", kind, (Pose(40.0, 0.0),), priority=9))
    hive.network.run(1.0)


def recalls(hive):
    """Return how often T7.1 was ordered back."""
    return sum(
        said.task.id == "T7.1" and said.kind is OrderKind.HAND_BACK_UNBEGUN
        for topic, said in hive.network.sent
        if topic == TASK_ASSIGN
    )


def add_strong(hive, **fields):
    kind = replace(SMALL_ROBOT, payload=90.0, arm_payload=90.0)
    hive.add_robot("strong", Pose(4.0, 0.0), kind, **fields)


@pytest.mark.parametrize("payloads", [(20.0,), (20.0, 20.0)])
@pytest.mark.parametrize("kind", [TaskType.GAB, TaskType.GA])
def test_a_split_is_undone_when_one_robot_can_carry_the_whole_and_no_part_has_begun(
    payloads, kind
):
    hive = queued(*payloads, task=replace(HEAVY, type=kind))
    before = [state for state, _ in parts(hive)]
    add_strong(hive)
    hive.network.run(60.0)

    assert before == [ASSIGNED, ASSIGNED]
    assert parts(hive) == []
    assert (hive.record("T7").state, hive.record("T7").robot) == (DONE, "strong")
    assert hive.states("T7") == [WAITING, ASSIGNED, WAITING, ASSIGNED, STARTED, DONE]
    assert hive.record("T0-0").state is DONE


@pytest.mark.parametrize("small_one_leaves", [False, True], ids=["on a list", "waiting"])
@pytest.mark.parametrize("decision", DECISIONS)
def test_a_strong_robot_that_comes_back_begins_no_part_of_what_it_can_carry(
    decision, small_one_leaves
):
    hive = team(20.0, settings=BlackboardSettings(decision=decision))
    no_arm = frozenset({TaskType.GA, TaskType.GAB})
    kind = replace(SMALL_ROBOT, payload=90.0, capabilities=no_arm)
    hive.add_robot("strong", Pose(4.0, 0.0), kind)
    hive.set_state("strong", "defect")
    hive.network.run(1.0)
    keep_busy(hive, 3, TaskType.GPA)
    hive.post(HEAVY)
    hive.network.run(6.0)
    if small_one_leaves:
        hive.set_state("robot1", "defect")
        hive.network.run(7.0)
    before = [state for state, _ in parts(hive)]
    hive.set_state("strong", "idle")
    hive.network.run(60.0)

    assert before == [WAITING if small_one_leaves else ASSIGNED] * 2
    assert parts(hive) == []
    assert (hive.record("T7").state, hive.record("T7").robot) == (DONE, "strong")


def test_the_robot_that_gets_the_whole_is_told_why_and_its_parts_are_told_as_cancelled():
    hive = queued(20.0)
    add_strong(hive)
    hive.network.run(12.0)

    told = [update.reason for update in hive.updates("T7")]
    assert "its split is undone: strong takes all of it" in told
    assert hive.states("T7.1")[-1] is CANCELLED
    assert hive.updates("T7.1")[-1].reason == "robots do T7 as a whole again"


def test_a_split_is_not_undone_once_a_part_has_begun():
    hive = team(20.0)
    hive.post(HEAVY)
    hive.network.run(3.0)
    add_strong(hive)
    hive.network.run(60.0)

    assert recalls(hive) == 0
    assert hive.record("T7.1").robot == "robot1"
    assert [state for state, _ in parts(hive)] == [DONE, DONE]
    assert hive.record("T7").state is DONE


def test_a_split_is_not_undone_once_a_part_was_begun_and_handed_back():
    hive = team(20.0)
    hive.post(HEAVY)
    hive.network.run(3.0)
    begun = hive.record("T7.1").state
    hive.set_state("robot1", "defect")
    hive.network.run(1.0)
    back = hive.record("T7.1")
    add_strong(hive)
    hive.network.run(60.0)

    assert (begun, back.state, back.step) == (STARTED, WAITING, 0)
    assert [state for state, _ in parts(hive)] == [DONE, DONE]


def unheard_start():
    """Return a hive in which robot1 has begun T7.1, and nobody has heard that."""

    def lose(topic, message):
        return topic == TASK_STATE and message.task_id == "T7.1" and message.state is STARTED

    hive = team(20.0, network=Network(lose=lose))
    hive.post(replace(HEAVY, type=TaskType.GPAB, payload=10.0))
    hive.network.run(3.0)
    return hive


def test_a_part_that_was_put_off_counts_as_begun_even_if_nobody_has_heard_of_its_start():
    hive = unheard_start()
    hive.post(Task("U", TaskType.GA, (Pose(2.0, 3.0),), priority=10))
    hive.network.run(2.0)
    add_strong(hive)
    hive.network.run(2 * REASSIGN)

    assert any(said.put_off_for == "U" for said in hive.updates("T7.1"))
    assert recalls(hive) == 0
    assert hive.record("T7").parts == 2


def test_a_part_of_which_a_step_was_done_counts_as_begun_even_if_nobody_has_heard_of_its_start():
    hive = unheard_start()
    hive.network.run(9.0)
    hive.set_state("robot1", "defect")
    hive.network.run(1.0)
    back = hive.record("T7.1")
    add_strong(hive)
    hive.network.run(2 * REASSIGN)

    assert (back.state, back.step) == (WAITING, 0)
    assert any(said.step == 1 for said in hive.updates("T7.1"))
    assert hive.record("T7").parts == 2


def test_if_no_robot_takes_the_whole_after_all_its_parts_go_on_at_once():
    hive = queued(20.0)
    keep_busy(hive, 5)
    add_strong(hive, charge=0.05)
    hive.network.run(1.0)
    before = [state for state, _ in parts(hive)]
    hive.network.run(REASSIGN + 3.0)
    after = [state for state, _ in parts(hive)]
    hive.network.run(180.0)

    assert (before, after) == ([WAITING, WAITING], [ASSIGNED, ASSIGNED])
    assert recalls(hive) == 1
    assert [state for state, _ in parts(hive)] == [DONE, DONE]
    assert hive.record("T7").state is DONE


def test_an_attempt_is_given_up_if_a_part_does_not_come_back():
    def lose(topic, message):
        recalls_it = topic == TASK_ASSIGN and message.kind is OrderKind.HAND_BACK_UNBEGUN
        return recalls_it and message.task.id == "T7.2"

    hive = queued(20.0, network=Network(lose=lose))
    keep_busy(hive, 8)
    add_strong(hive, charge=0.05)
    hive.network.run(3 * REASSIGN)
    before = [state for state, _ in parts(hive)]
    hive.network.run(2 * REASSIGN)

    assert before == [WAITING, ASSIGNED]
    assert [state for state, _ in parts(hive)] == [ASSIGNED, ASSIGNED]


def test_a_split_is_not_undone_while_a_part_may_be_at_work_out_of_reach():
    hive = queued(20.0, 20.0)
    keep_busy(hive, 4)
    robot = hive.record("T7.1").robot
    hive.talkers[robot].connected = False
    hive.network.run(7.0)
    add_strong(hive)
    hive.network.run(120.0)

    assert recalls(hive) == 0
    assert [state for state, _ in parts(hive)] == [DONE, DONE]


def test_an_order_for_a_part_that_comes_late_is_not_obeyed_once_the_split_is_undone():
    hive = queued(20.0)
    given = [
        said
        for topic, said in hive.network.sent
        if topic == TASK_ASSIGN and said.task.id == "T7.1" and said.kind is OrderKind.ASSIGN
    ]
    add_strong(hive)
    while hive.record("T7").parts:
        hive.network.run(0.1)
    hive.talkers["blackboard"].publish(TASK_ASSIGN, given[-1])
    hive.network.run(0.1)

    assert hive.robots["robot1"].status.tasks == ()


def test_a_robot_that_comes_and_goes_does_not_undo_splits_without_end():
    hive = queued(20.0)
    keep_busy(hive, 8)
    add_strong(hive)
    for _ in range(12):
        hive.set_state("strong", "idle")
        hive.network.run(1.5)
        hive.set_state("strong", "defect")
        hive.network.run(1.5)

    assert recalls(hive) == MOST_ATTEMPTS
    assert hive.record("T7").parts == 2


def test_what_was_split_again_after_its_split_was_undone_is_done_in_parts():
    hive = queued(20.0)
    hive.post(Task("T0-9", TaskType.GA, (Pose(80.0, 0.0),)))
    hive.network.run(1.0)
    add_strong(hive)
    hive.network.run(10.0)
    undone = hive.record("T7").parts
    hive.set_state("strong", "defect")
    hive.network.run(200.0)

    assert undone == 0
    assert [state for state, _ in parts(hive)] == [DONE, DONE]
    assert hive.record("T7").state is DONE


def test_a_part_that_was_split_again_is_joined_too():
    hive = queued(30.0, 10.0)
    hive.set_state("robot1", "defect")
    hive.network.run(3.0)
    split_again = hive.record("T7.1").parts
    add_strong(hive)
    hive.network.run(60.0)

    assert split_again == 3
    assert (hive.record("T7.1").parts, hive.record("T7.1").robot) == (0, "strong")
    assert parts(hive) == [(DONE, 27.0), (DONE, 9.0)]
    assert hive.record("T7").state is DONE


@pytest.mark.parametrize("kind", [TaskType.GAB, TaskType.GPAB])
def test_a_task_that_is_not_to_be_split_waits_and_says_why(kind):
    hive = team(20.0, 10.0)
    hive.post(replace(HEAVY, type=kind, no_split=True))
    hive.network.run(5.0)
    record = hive.record("T7")

    assert (record.state, record.parts) == (WAITING, 0)
    assert "robot1: carries at most 20 kg, not 36 kg" in record.reason
    assert "too heavy for any one robot (robot1 carries most: " in record.reason
    assert "it is not to be split; what would help: a robot that carries 36 kg" in record.reason


def test_a_robot_out_of_service_that_could_carry_it_is_named():
    hive = team(20.0, 50.0, 60.0)
    for robot in ("robot2", "robot3"):
        hive.set_state(robot, "defect")
    hive.network.run(1.0)
    hive.post(replace(HEAVY, no_split=True))
    hive.network.run(5.0)

    assert hive.record("T7").reason.endswith("; what would help: robot2 or robot3 back in service")


def test_where_no_robot_is_in_service_those_that_could_do_it_are_named():
    hive = team(20.0, 50.0)
    for robot in ("robot1", "robot2"):
        hive.set_state(robot, "defect")
    hive.network.run(1.0)
    hive.post(HEAVY)
    hive.network.run(5.0)

    assert hive.record("T7").reason == (
        "no robot is in service; what would help: robot2 back in service"
    )


def test_the_whole_says_at_once_into_what_it_is_split_and_why():
    hive = team(20.0)
    hive.post(HEAVY)
    hive.network.run(0.5)

    assert hive.record("T7").reason == (
        "split into 2 parts of 18 kg, because robot1 carries most, 20 kg; 0 of 2 parts done"
    )
