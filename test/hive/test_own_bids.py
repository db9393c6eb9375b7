# SPDX-License-Identifier: BSD-3-Clause
"""Robots that bid themselves, in hives whose leader works out the bids of all others."""

from dataclasses import replace

import pytest

from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import TASK_BROADCAST
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.task_checker import TaskChecker


class OwnBids:
    """What answers for a robot of another make: it knows bids only, and bids in its own way."""

    def __init__(self, robot, factor):
        self._answers = robot._respondent  # noqa: SLF001
        self._factor = factor

    def answer(self, broadcast, *where, **how):
        answer = self._answers.answer(replace(broadcast, basis=False), *where, **how)
        bids = tuple(
            replace(bid, cost=min(bid.cost * self._factor, 999.0), terms=None)
            if bid.is_able
            else bid
            for bid in answer.bids
        )
        return replace(answer, bids=bids)


class UnknownModel:
    """What answers for a robot with a cost model that the leader does not know."""

    def __init__(self, robot):
        self._answers = robot._respondent  # noqa: SLF001

    def answer(self, broadcast, *where, **how):
        answer = self._answers.answer(broadcast, *where, **how)
        if answer.basis is not None:
            answer = replace(answer, basis=replace(answer.basis, cost_model="of its maker"))
        return answer


@pytest.fixture(params=["centralized", "planned"])
def decision(request):
    return request.param


def give(robot, answers):
    """Have something else answer for a robot."""
    robot._respondent = answers  # noqa: SLF001


def fleet(decision, *places, own=(), factor=1.0):
    """Return a hive with a robot at each of some places; some of the robots bid themselves."""
    hive = Hive(BlackboardSettings(decision=decision))
    TaskChecker(hive)
    for number, x in enumerate(places, start=1):
        name = f"robot{number}"
        robot = hive.add_robot(name, Pose(x, 0.0), cost_model="latency")
        if name in own:
            give(robot, OwnBids(robot, factor))
    hive.network.run(2.0)
    return hive


def go(number, x, kind=TaskType.GA):
    return Task(f"T{number}", kind, (Pose(x, 0.0),))


def robots(hive, *tasks):
    """Return who has each task, when all are done."""
    hive.network.run(300.0)
    assert hive.all_ended(*tasks)
    return [hive.record(task_id).robot for task_id in tasks]


def test_a_robot_that_bids_itself_gets_what_it_is_best_for(decision):
    hive = fleet(decision, 0.0, 50.0, 100.0, own=["robot3"])
    hive.post(go(1, 99.0))
    hive.network.run(30.0)
    hive.post(go(2, 1.0), go(3, 51.0), go(4, 98.0))

    assert robots(hive, "T1", "T2", "T3", "T4") == ["robot3", "robot1", "robot2", "robot3"]


def test_of_the_first_burst_it_gets_one_too(decision):
    hive = fleet(decision, 0.0, 100.0, own=["robot2"])
    hive.post(*(go(number, 90.0 + number) for number in range(5)))

    assert "robot2" in robots(hive, *(f"T{number}" for number in range(5)))


def test_a_robot_that_bids_high_gets_little(decision):
    hive = fleet(decision, 0.0, 5.0, own=["robot2"], factor=900.0)
    hive.post(go(1, 4.0))
    hive.network.run(30.0)
    hive.post(go(2, 4.0), go(3, 6.0))

    assert robots(hive, "T1", "T2", "T3") == ["robot1"] * 3


def test_what_only_a_robot_that_bids_itself_can_do_it_does(decision):
    hive = fleet(decision)
    no_arm = replace(SMALL_ROBOT, capabilities=frozenset({TaskType.GA}))
    hive.add_robot("robot1", Pose(0.0, 0.0), no_arm, cost_model="latency")
    robot2 = hive.add_robot("robot2", Pose(50.0, 0.0), cost_model="latency")
    give(robot2, OwnBids(robot2, 1.0))
    hive.network.run(1.0)
    hive.post(go(1, 1.0, TaskType.GPA), go(2, 2.0))

    assert robots(hive, "T1")[0] == "robot2"


def test_only_robots_that_bid_themselves_do_all_there_is(decision):
    hive = fleet(decision, 0.0, 100.0, own=["robot1", "robot2"])
    hive.post(*(go(number, 20.0 * number) for number in range(6)))

    assert set(robots(hive, *(f"T{number}" for number in range(6)))) == {"robot1", "robot2"}


def test_a_robot_with_a_cost_model_that_the_leader_does_not_know_is_asked_for_bids(decision):
    hive = fleet(decision, 0.0, 100.0)
    give(hive.robots["robot2"], UnknownModel(hive.robots["robot2"]))
    hive.post(go(1, 99.0))

    assert robots(hive, "T1") == ["robot2"]
    hive.post(go(2, 98.0), go(3, 1.0))
    assert robots(hive, "T2", "T3") == ["robot2", "robot1"]


def test_nobody_else_is_sent_the_tasks(decision):
    hive = fleet(decision, 0.0, 100.0, own=["robot2"])
    hive.post(go(1, 99.0))
    hive.network.run(30.0)
    hive.post(go(2, 1.0), go(3, 98.0))
    hive.network.run(30.0)

    calls = [call for topic, call in hive.network.heard if topic == TASK_BROADCAST]
    assert all(call.basis or set(call.asked) == {"robot2"} for call in calls)
    assert any(call.tasks for call in calls)


def test_a_task_on_a_list_goes_to_a_robot_that_bids_much_less_for_it():
    hive = fleet("planned", 0.0)
    hive.post(go(1, 5.0), go(2, 80.0), go(3, 82.0))
    hive.network.run(1.0)
    robot2 = hive.add_robot("robot2", Pose(81.0, 0.0), cost_model="latency")
    give(robot2, OwnBids(robot2, 1.0))

    done_by = robots(hive, "T1", "T2", "T3")

    assert done_by[0] == "robot1"
    assert "robot2" in done_by


def test_many_robots_that_bid_themselves_are_found_in_one_round(decision):
    names = [f"robot{number}" for number in range(1, 9)]
    hive = fleet(decision, *(10.0 * number for number in range(8)), own=names[2:])
    hive.post(go(1, 1.0))

    assert robots(hive, "T1") == ["robot1"]
    calls = [call for topic, call in hive.network.heard if topic == TASK_BROADCAST]
    assert len(calls) == 3
    assert hive.talkers["blackboard"].warnings == []


class Alternating:
    """What answers for a robot that tells now a basis, now bids, whatever it is asked for."""

    def __init__(self, robot):
        self._answers = robot._respondent  # noqa: SLF001
        self._turn = 0

    def answer(self, broadcast, *where, **how):
        self._turn += 1
        return self._answers.answer(replace(broadcast, basis=self._turn % 2 == 0), *where, **how)


def test_with_a_robot_that_answers_now_so_and_now_so_every_task_is_done_and_moves_end():
    hive = fleet("planned", 0.0, 90.0)
    give(hive.robots["robot2"], Alternating(hive.robots["robot2"]))
    tasks = [f"T{number}" for number in range(8)]
    hive.post(*(go(number, 11.0 * number) for number in range(8)))
    robots(hive, *tasks)

    assert max(hive.record(task_id).assignment for task_id in tasks) <= 3


class Odd:
    """What answers for a robot that tells what cannot be."""

    def __init__(self, robot, **odd):
        self._answers = robot._respondent  # noqa: SLF001
        self._odd = odd

    def answer(self, broadcast, *where, **how):
        answer = self._answers.answer(broadcast, *where, **how)
        return replace(answer, basis=answer.basis and replace(answer.basis, **self._odd))


@pytest.mark.parametrize(
    "odd",
    [{"charge": 5.0}, {"charge": -0.01}, {"pace": (1.0,)}, {"tasks": (("T1", 0),) * 9}],
    ids=str,
)
def test_a_robot_that_tells_what_cannot_be_holds_up_nobody(decision, odd):
    hive = fleet(decision, 0.0, 50.0)
    give(hive.robots["robot2"], Odd(hive.robots["robot2"], **odd))
    hive.post(go(1, 5.0), go(2, 45.0), go(3, 8.0))

    assert robots(hive, "T1", "T2", "T3") == ["robot1"] * 3
    assert any("robot2 cannot be bid for" in text for text in hive.talkers["blackboard"].warnings)


def test_a_robot_out_of_service_that_bids_itself_holds_up_no_auction(decision):
    hive = fleet(decision, 0.0, 5.0, own=["robot1"])
    hive.set_state("robot1", "defect")
    hive.network.run(1.0)
    for number in (1, 2):
        hive.post(go(number, 4.0))
        hive.network.run(30.0)

    calls = [call for topic, call in hive.network.heard if topic == TASK_BROADCAST]
    assert len(calls) == 2
    assert hive.record("T2").robot == "robot2"
