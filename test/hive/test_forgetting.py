# SPDX-License-Identifier: BSD-3-Clause
"""Hives that forget ended tasks: nothing is lost, and nobody repeats a report for ever."""

from dataclasses import replace

from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.talker import SYNC, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import Hive
from hive_lab.virtual.task_checker import TaskChecker

GO = Task("T1", TaskType.GA, (Pose(1.0, 1.0),))
HEAVY = replace(GO, id="T7", payload=35.0)


def hive_of(*robots, **settings):
    """Return a hive that soon forgets, with its properties checked."""
    hive = Hive(BlackboardSettings(**{"keep_ended": 20.0, **settings}))
    TaskChecker(hive)
    for name in robots:
        hive.add_robot(name, Pose(0.0, 0.0))
    return hive


def listed(hive):
    """Return the ids on the last published list."""
    known = [message for topic, message in hive.network.heard if topic == SYNC][-1]
    return [record.task.id for record in known.records]


def reported(hive, since):
    """Return what was said about tasks after so many messages."""
    return [message for topic, message in hive.network.heard[since:] if topic == TASK_STATE]


def test_the_list_stays_short_however_many_tasks_there_have_been():
    hive = hive_of("robot1", most_ended=5)
    lengths = []
    for number in range(40):
        hive.post(replace(GO, id=f"T{number}"))
        hive.network.run(12.0)
        lengths.append(len(listed(hive)))

    assert max(lengths) <= 4


def test_a_robot_that_was_cut_off_until_its_task_was_forgotten_falls_silent_about_it():
    hive = hive_of("robot1", "robot2")
    hive.post(GO)
    hive.network.run_until(lambda: hive.commands["robot1"].running is not None, 5.0)
    hive.talkers["robot1"].connected = False
    hive.network.run(60.0)
    assert listed(hive) == []

    hive.talkers["robot1"].connected = True
    hive.network.run(5.0)
    said = len(hive.network.heard)
    hive.network.run(20.0)

    assert hive.robots["robot1"].status.tasks == ()
    assert reported(hive, said) == []
    assert listed(hive) == []


def test_a_task_that_is_posted_again_after_it_was_forgotten_is_a_new_one():
    hive = hive_of("robot1")
    hive.post(GO)
    hive.network.run(45.0)
    hive.post(replace(GO, type=TaskType.GAB, goals=(Pose(1.0, 1.0), Pose(2.0, 2.0))))
    hive.network.run(5.0)
    assert hive.record("T1").state is TaskState.STARTED

    hive.network.run(25.0)
    assert hive.record("T1").state is TaskState.DONE


def test_a_task_that_was_split_is_forgotten_with_its_parts():
    hive = hive_of("robot1", "robot2")
    hive.post(HEAVY)
    hive.network.run(5.0)
    assert listed(hive) == ["T7", "T7.1", "T7.2"]

    hive.network.run(45.0)
    assert listed(hive) == []
