# SPDX-License-Identifier: BSD-3-Clause
"""Hives whose leader plans all tasks together."""

import random
from dataclasses import replace
from itertools import pairwise

import pytest

from blackboard.auction.plan_maker import HOLD, LONGEST, MOMENT
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import BACKUP, TASK_ASSIGN
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.inline_searcher import InlineSearcher
from hive_lab.virtual.task_checker import TaskChecker

PLANNED = BlackboardSettings(decision="planned")


def fleet(*places, settings=PLANNED):
    """Return a hive with a robot at each of some places on the x axis."""
    hive = Hive(settings)
    TaskChecker(hive)
    for number, x in enumerate(places):
        hive.add_robot(f"robot{number + 1}", Pose(x, 0.0), cost_model="latency")
        hive.commands[f"robot{number + 1}"].duration = lambda _: 10.0
    hive.network.run(2.0)
    return hive


def go(number, x, priority=0):
    """Return a task to go to a place on the x axis."""
    return Task(f"T{number}", TaskType.GA, (Pose(x, 0.0),), priority)


def first_order(hive, task_id):
    """Return who was the first to get a task; None if nobody has got it yet."""
    return next(
        (update.robot_id for update in hive.updates(task_id) if update.robot_id),
        None,
    )


def test_a_single_task_on_an_idle_fleet_is_given_out_as_soon_as_without_plans():
    waits = []
    for decision in ("centralized", "planned"):
        hive = fleet(0.0, 20.0, settings=BlackboardSettings(decision=decision))
        began = hive.network.now
        hive.post(go(1, 18.0))
        while first_order(hive, "T1") is None:
            hive.network.run(0.001)
        waits.append(hive.network.now - began)

    assert first_order(hive, "T1") == "robot2"
    assert waits[1] <= waits[0] + 1e-9
    assert waits[1] < HOLD / 10


def test_of_a_burst_no_task_starts_before_all_are_planned():
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 90.0), go(2, 10.0))
    hive.network.run(0.02)
    hive.post(go(3, 95.0), go(4, 5.0))
    hive.network.run(HOLD + 1.0)

    on_lists = {name: robot.status.tasks for name, robot in hive.robots.items()}
    assert on_lists == {"robot1": ("T4", "T2"), "robot2": ("T3", "T1")}


def test_a_burst_of_a_few_tasks_is_held_for_a_shorter_time():
    hive = fleet(0.0, 100.0)
    began = hive.network.now
    hive.post(go(1, 90.0), go(2, 10.0), go(3, 50.0))
    while first_order(hive, "T3") is None:
        hive.network.run(0.001)

    assert hive.network.now - began < HOLD / 5


def test_a_burst_without_end_is_held_for_two_seconds_at_most():
    hive = fleet(0.0, 100.0)
    for number in range(round((HOLD + 0.5) / 0.02)):
        hive.post(go(number, float(number % 100)))
        hive.network.run(0.02)

    planned = [update for topic, update in hive.network.sent if topic == TASK_ASSIGN]
    assert len(planned) > 50


def test_a_task_that_comes_while_robots_work_is_put_where_it_adds_least():
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 50.0), go(2, 60.0))
    hive.network.run(1.0)
    hive.post(go(3, 20.0), go(4, 10.0))
    hive.network.run(1.0)
    began = hive.network.now
    hive.post(go(5, 55.0))
    while first_order(hive, "T5") is None:
        hive.network.run(0.001)

    assert MOMENT < hive.network.now - began < 2 * MOMENT
    assert first_order(hive, "T5") == "robot2"


def begun_alone(kind, pause):
    """Return a robot's list: a long task comes alone, and two short ones after a pause [s]."""
    hive = fleet(0.0)
    hive.post(Task("T1", kind, (Pose(100.0, 0.0),)))
    hive.network.run(pause)
    assert hive.updates("T1")[-1].state is TaskState.STARTED
    hive.post(go(2, 5.0), go(3, 6.0))
    hive.network.run(1.0)
    assert hive.record("T1").tried == ()
    return hive


def test_a_task_that_was_given_out_alone_a_moment_before_a_burst_is_planned_with_it():
    hive = begun_alone(TaskType.GA, 0.05)

    assert hive.robots["robot1"].status.tasks == ("T2", "T3", "T1")
    hive.network.run(60.0)
    assert hive.all_ended("T1", "T2", "T3")
    assert sum(update.state is TaskState.DONE for update in hive.updates("T1")) == 1


def test_a_task_that_a_robot_has_begun_for_longer_stays_where_it_is():
    hive = begun_alone(TaskType.GA, 0.3)

    assert hive.robots["robot1"].status.tasks[0] == "T1"


def test_a_task_for_an_arm_that_was_begun_stays_where_it_is():
    hive = begun_alone(TaskType.GPA, 0.05)

    assert hive.robots["robot1"].status.tasks[0] == "T1"


def test_a_burst_that_came_to_nothing_makes_no_task_fresh_for_later_ones():
    hive = fleet(0.0)
    hive.commands["robot1"].duration = lambda _: 30.0
    hive.post(go(1, 100.0))
    hive.network.run(0.05)
    hive.post(go(2, 5.0))
    hive.network.run(0.02)
    hive.post(go(3, 6.0))
    hive.network.run(0.06)
    hive.cancel("T2")
    hive.cancel("T3")
    hive.network.run(5.0)
    hive.post(go(4, 5.0), go(5, 6.0))
    hive.network.run(1.0)

    assert hive.robots["robot1"].status.tasks[0] == "T1"


def test_an_urgent_task_that_was_begun_stays_where_it_is():
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 49.0, priority=10))
    hive.network.run(0.05)
    hive.post(go(2, 10.0), go(3, 5.0))
    hive.network.run(1.0)

    assert hive.robots["robot1"].status.tasks[0] == "T1"
    states = [update.state for update in hive.updates("T1")]
    assert TaskState.WAITING not in states[states.index(TaskState.STARTED) :]


def test_where_the_search_fails_tasks_are_auctioned_and_the_log_says_so(monkeypatch):
    monkeypatch.setattr(
        InlineSearcher,
        "search",
        lambda self, _job, done: self._clock.after(0.1, lambda: done(None)),
    )
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 90.0), go(2, 10.0), go(3, 95.0))
    hive.network.run(120.0)

    assert hive.all_ended("T1", "T2", "T3")
    warnings = hive.talkers["blackboard"].warnings
    assert sum("the search for a plan has failed" in text for text in warnings) == 1


def test_a_search_that_never_ends_is_not_waited_for(monkeypatch):
    monkeypatch.setattr(InlineSearcher, "search", lambda *_: None)
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 90.0), go(2, 10.0), go(3, 95.0))
    hive.network.run(LONGEST + 120.0)

    assert hive.all_ended("T1", "T2", "T3")


def test_a_robot_s_own_list_is_put_into_a_better_order():
    hive = fleet(0.0)
    hive.post(go(1, 50.0))
    hive.network.run(1.0)
    hive.post(go(2, 40.0))
    hive.network.run(1.0)
    hive.post(go(3, 10.0))
    hive.network.run(5.0)

    assert hive.robots["robot1"].status.tasks == ("T1", "T2", "T3")


def test_a_task_that_only_one_robot_can_do_goes_to_it_whatever_the_plan():
    hive = fleet(0.0, 1.0)
    weak = replace(SMALL_ROBOT, payload=2.0)
    hive.add_robot("robot1", Pose(0.0, 0.0), weak, cost_model="latency")
    heavy = Task("T1", TaskType.GA, (Pose(0.0, 0.0),), payload=10.0)
    hive.post(heavy, go(2, 0.5), go(3, 0.2))
    hive.network.run(60.0)

    assert first_order(hive, "T1") == "robot2"
    assert hive.all_ended("T1", "T2", "T3")


def test_a_task_that_nobody_can_do_says_why_and_holds_up_no_other():
    hive = fleet(0.0, 5.0)
    hive.post(Task("T1", TaskType.GPA, (Pose(0.0, 0.0),), payload=900.0), go(2, 1.0), go(3, 4.0))
    hive.network.run(60.0)

    assert hive.all_ended("T2", "T3")
    assert "nobody can take it" in hive.record("T1").reason


def test_an_urgent_task_does_not_wait_for_a_plan():
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 90.0), go(2, 10.0), go(3, 95.0))
    hive.network.run(0.01)
    hive.post(go(9, 5.0, priority=10))
    hive.network.run(HOLD + 0.5)

    assert hive.robots["robot1"].status.task_id == "T9"


def test_why_a_planned_task_went_to_a_robot_is_noted_with_its_cost_for_each():
    hive = fleet(0.0, 100.0)
    hive.add_robot("robot3", Pose(50.0, 0.0), replace(SMALL_ROBOT, payload=1.0))
    hive.network.run(1.0)
    tasks = [replace(go(number, x), payload=2.0) for number, x in ((1, 90.0), (2, 10.0))]
    hive.post(*tasks)
    hive.network.run(HOLD)

    why = {each.task_id: each for each in hive.decisions}
    robot1, robot2, robot3 = why["T2"].bids
    assert why["T2"].winner == "robot1"
    assert why["T2"].reason.startswith("planned together with 1 other")
    assert robot1.cost < robot2.cost
    assert (robot1.terms.place, robot2.terms.place) == (1, 2)
    assert (robot1.terms.way, robot2.terms.way) == (10.0, pytest.approx(80.0))
    assert robot3.reason == "carries at most 1 kg, not 2 kg"


def test_what_is_planned_when_the_leader_steps_down_is_planned_anew():
    hive = fleet(0.0, 100.0)
    hive.post(go(1, 90.0), go(2, 10.0), go(3, 95.0))
    hive.network.run(0.05)
    hive.talkers["blackboard"].connected = False
    hive.network.run(8.0)
    hive.talkers["blackboard"].connected = True
    hive.network.run(120.0)

    assert all(hive.record(f"T{number}").state is TaskState.DONE for number in (1, 2, 3))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_every_task_of_a_large_burst_is_done_and_no_heartbeat_is_late(seed):
    draw = random.Random(seed)
    hive = fleet(*(draw.uniform(0.0, 60.0) for _ in range(4)))
    beats = []
    hive.network.listen(BACKUP, lambda _: beats.append(hive.network.now))
    names = [f"T{number}" for number in range(30)]
    for number in range(30):
        kind = draw.choice(list(TaskType))
        goals = tuple(Pose(draw.uniform(0.0, 60.0), 0.0) for _ in range(2))
        hive.post(Task(names[number], kind, goals, draw.choice([0, 0, 5, 10])))
    hive.network.run(400.0)

    assert hive.all_ended(*names)
    gaps = [after - before for before, after in pairwise(beats)]
    assert max(gaps) < 0.4
