# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives when nothing goes wrong."""

from collections import Counter
from dataclasses import replace

from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.task_checker import TaskChecker

AGV = replace(
    SMALL_ROBOT,
    capabilities=frozenset({TaskType.GA, TaskType.GAB}),
    payload=100.0,
    max_speed=1.5,
    arm_payload=0.0,
)
DONE_IN_ORDER = [TaskState.WAITING, TaskState.ASSIGNED, TaskState.STARTED, TaskState.DONE]


def fleet():
    """Return a hive of two vehicles and two mobile manipulators, and its properties."""
    hive = Hive()
    properties = TaskChecker(hive)
    for name, x, kind in [
        ("robot1", 0.0, AGV),
        ("robot2", 10.0, AGV),
        ("robot3", 0.0, SMALL_ROBOT),
        ("robot4", 10.0, SMALL_ROBOT),
    ]:
        hive.add_robot(name, Pose(x, 0.0), kind)
    return hive, properties


def mixed(number):
    """Return the n-th of many tasks of all types, priorities and places."""
    goals = (Pose(number * 7 % 20, number * 3 % 12), Pose(number * 11 % 20, number * 5 % 12))
    kind = TaskType(number % 4)
    return Task(f"T{number}", kind, goals, priority=number * 3 % 11, payload=number % 5)


def test_forty_tasks_of_all_kinds_are_done_once_each_by_four_robots():
    hive, properties = fleet()
    tasks = [mixed(number) for number in range(40)]
    names = [task.id for task in tasks]
    hive.post(*tasks)

    ended = hive.network.run_until(lambda: hive.all_ended(*names), limit=3600.0)
    hive.network.run(5.0)

    assert ended
    # A task that has not begun may change hands, so it may be assigned more than once.
    assert all(hive.states(name)[:2] == DONE_IN_ORDER[:2] for name in names)
    assert all(hive.states(name)[-2:] == DONE_IN_ORDER[-2:] for name in names)
    assert properties.unfinished() == {}
    done = {update for name in names for update in hive.updates(name) if update.state == 3}
    assert max(Counter(update.task_id for update in done).values()) == 1
    assert {update.robot_id for update in done} == {"robot1", "robot2", "robot3", "robot4"}


def test_only_robots_with_an_arm_pick():
    hive, _ = fleet()
    tasks = [replace(mixed(number), type=TaskType.GPAB) for number in range(8)]
    hive.post(*tasks)
    hive.network.run(600.0)

    robots = {hive.record(task.id).robot for task in tasks}
    assert robots == {"robot3", "robot4"}


def test_each_robot_goes_where_it_is_nearest():
    hive, _ = fleet()
    hive.post(
        Task("left", TaskType.GPA, (Pose(0.0, 2.0),)),
        Task("right", TaskType.GPA, (Pose(10.0, 2.0),)),
    )
    hive.network.run(1.0)

    assert hive.record("left").robot == "robot3"
    assert hive.record("right").robot == "robot4"


def test_what_is_urgent_is_done_before_what_waits_already():
    hive = Hive()
    hive.add_robot("robot1", Pose(0.0, 0.0))
    lows = [Task(f"low{i}", TaskType.GA, (Pose(i, 0.0),), priority=1) for i in range(4)]
    hive.post(*lows)
    hive.network.run(5.0)
    hive.post(Task("urgent", TaskType.GA, (Pose(9.0, 0.0),), priority=9))
    hive.network.run_until(lambda: hive.all_ended("urgent"), limit=60.0)

    ended = [task.id for task in lows if hive.all_ended(task.id)]
    assert len(ended) == 1  # the one that was under way


def test_a_task_that_comes_while_all_are_busy_is_done_when_its_turn_comes():
    hive = Hive()
    hive.add_robot("robot1", Pose(0.0, 0.0))
    hive.post(Task("first", TaskType.GA, (Pose(5.0, 0.0),)))
    hive.network.run(3.0)
    hive.post(Task("second", TaskType.GA, (Pose(6.0, 0.0),)))
    hive.network.run(30.0)

    assert hive.states("second") == DONE_IN_ORDER


def test_after_the_last_task_the_hive_is_quiet():
    hive, _ = fleet()
    names = [f"T{number}" for number in range(12)]
    hive.post(*(mixed(number) for number in range(12)))
    hive.network.run_until(lambda: hive.all_ended(*names), limit=3600.0)
    hive.network.run(2.0)
    before = Counter(topic for topic, _ in hive.network.heard)
    hive.network.run(60.0)

    after = Counter(topic for topic, _ in hive.network.heard)
    assert (after - before).keys() == {"robot_status", "bb_backup"}


def test_the_same_hive_does_the_same_every_time():
    def history():
        hive, _ = fleet()
        hive.post(*(mixed(number) for number in range(10)))
        hive.network.run(300.0)
        return hive.network.heard

    assert history() == history()
