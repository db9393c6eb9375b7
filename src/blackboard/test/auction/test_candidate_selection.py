# SPDX-License-Identifier: BSD-3-Clause
"""Which tasks a call for bids offers, and which robots of a large fleet it asks."""

import pytest

from blackboard.auction.candidate_selection import CandidateSelection
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import TASK_BROADCAST
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive

FLEET = frozenset({"near", "far", "loaded", "unheard"})


def record(name, priority=0, place=0.0):
    return TaskRecord(Task(name, TaskType.GA, (Pose(place, 0.0),), priority))


def last(robot):
    """Return the status of a robot of the fleet."""
    if robot == "unheard":
        return None
    place = 100.0 if robot == "far" else 1.0
    tasks = ("T8", "T9") if robot == "loaded" else ()
    return RobotStatus(robot, RobotState.IDLE, Pose(place, 0.0), 1.0, tasks=tasks)


def names(records):
    return [each.task.id for each in records]


def test_everything_is_offered_if_that_is_not_too_much():
    records = [record("T1"), record("T2", 5)]

    assert CandidateSelection(100, 100, 4).offers(records, robots=2) is records


def test_the_most_urgent_and_then_the_oldest_are_offered_first():
    records = [record("T1"), record("T2", 5), record("T3"), record("T4", 9)]

    assert names(CandidateSelection(100, 100, 6).offers(records, robots=2)) == [
        "T4",
        "T2",
        "T1",
    ]


def test_no_more_is_offered_than_a_few_rounds_can_award():
    records = [record(f"T{number}") for number in range(9)]

    assert names(CandidateSelection(100, 2, 100).offers(records, robots=3)) == names(records[:6])


def test_an_offer_stays_alone_while_it_has_a_task_for_each_robot():
    records = [record(f"T{number}") for number in range(9)]
    selection = CandidateSelection(100, 2, 100)

    assert names(selection.offers(records, 3, {"T2", "T4", "T6"})) == ["T2", "T4", "T6"]
    assert names(selection.offers(records, 3, {"T2", "T4"})) == names(records[:6])


def test_a_call_to_many_robots_stays_until_half_of_it_is_awarded():
    records = [record(f"T{number}") for number in range(9)]
    selection = CandidateSelection(100, 4, 24)

    assert names(selection.offers(records, 6, {"T2", "T4"})) == ["T2", "T4"]
    assert names(selection.offers(records, 6, {"T2"})) == names(records[:4])


def test_a_more_urgent_task_is_offered_at_once():
    records = [record("T1"), record("T2", 5), record("T3"), record("T4", 5), record("T5", 9)]
    selection = CandidateSelection(100, 2, 100)

    assert names(selection.offers(records, 2, {"T2", "T4"})) == ["T5", "T2", "T4", "T1"]
    assert names(selection.offers(records, 2, {"T2", "T4", "T5"})) == ["T5", "T2", "T4"]


def test_one_task_is_offered_however_many_robots_there_are():
    assert names(CandidateSelection(100, 100, 6).offers([record("T1"), record("T2")], 1000)) == [
        "T1"
    ]


def test_all_robots_of_a_small_fleet_are_asked():
    assert CandidateSelection(4, 100, 100).asked([record("T1")], FLEET, last) == FLEET


@pytest.mark.parametrize(
    ("most", "asked"), [(1, {"unheard"}), (2, {"near", "unheard"}), (3, FLEET - {"loaded"})]
)
def test_the_shortest_schedules_are_asked_first_and_among_equals_the_nearest(most, asked):
    offers = [record("T1"), record("T2", place=-50.0)]

    assert CandidateSelection(most, 100, 100).asked(offers, FLEET, last) == asked


def test_a_task_that_the_robots_asked_first_cannot_take_is_offered_to_all():
    hive = Hive(BlackboardSettings(most_asked=1))
    for name, place in (("near", 0.0), ("far", 50.0)):
        hive.add_robot(name, Pose(place, 0.0), charge=0.05 if name == "near" else 1.0)

    hive.post(Task("T1", TaskType.GA, (Pose(1.0, 0.0),)))
    hive.network.run(1.0)

    calls = [message for topic, message in hive.network.heard if topic == TASK_BROADCAST]
    assert [set(call.asked) for call in calls] == [{"near"}, {"far"}]
    assert hive.record("T1").robot == "far"


def test_a_long_task_list_is_awarded_call_by_call():
    hive = Hive(BlackboardSettings(most_bids=4))
    for name in ("robot1", "robot2"):
        hive.add_robot(name, Pose(0.0, 0.0))

    hive.post(*(Task(f"T{number}", TaskType.GA, (Pose(1.0, 0.0),)) for number in range(6)))
    hive.network.run(5.0)

    calls = [message for topic, message in hive.network.heard if topic == TASK_BROADCAST]
    assert max(len(call.tasks) for call in calls) == 2
    assert all(hive.record(f"T{number}").robot for number in range(6))
