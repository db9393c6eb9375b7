# SPDX-License-Identifier: BSD-3-Clause
"""How a benchmark posts tasks and hears when they are assigned, whatever carries the messages."""

from __future__ import annotations

import socket

import pytest

pytest.importorskip("blackboard.msg", reason="benchmarks of processes need ROS")

import rospy
from blackboard.msg import TaskState

from blackboard.errors import LiveHiveError
from hive_lab.live import zenoh_hive
from hive_lab.live.desk import Desk
from hive_lab.live.zenoh_hive import free_ports

SIDE = 60.0
NO_TIME = 0.0


class FakeWire:
    """A hive that answers at once, unless it misses what is posted or cancelled first."""

    is_heard = True

    def __init__(self, misses=0, says=TaskState.ASSIGNED):
        self.misses = misses
        self.says = says
        self.posted, self.cancelled = [], []

    def post(self, task):
        self.posted.append(task)
        self._answer(task.id, self.says)

    def cancel(self, task_id):
        self.cancelled.append(task_id)
        self._answer(task_id, TaskState.CANCELLED)

    def follow(self, hear):
        self.hear = hear

    def _answer(self, task_id, state):
        if self.misses:
            self.misses -= 1
        else:
            self.hear(TaskState(task_id=task_id, state=state))


@pytest.fixture(autouse=True)
def _at_once(monkeypatch):
    """Say again at once what is not answered; posted tasks have a time outside a node, too."""
    monkeypatch.setattr("rospy.Time.now", rospy.Time)
    monkeypatch.setattr("hive_lab.live.desk._REPEAT", NO_TIME)


def test_tasks_have_names_of_their_own_and_goals_in_the_square():
    wire = FakeWire()
    names = Desk(wire, SIDE).post(50)

    assert names == [task.id for task in wire.posted]
    assert len(set(names)) == 50
    goals = [task.goals[0] for task in wire.posted]
    assert all(0.0 <= value <= SIDE for goal in goals for value in (goal.x, goal.y))


@pytest.mark.parametrize("says", [TaskState.ASSIGNED, TaskState.STARTED])
def test_a_task_is_waited_for_until_a_robot_has_it(says):
    desk = Desk(FakeWire(says=says), SIDE)
    first, second = desk.post(2)

    assert desk.wait([first]) <= desk.wait([first, second])


def test_a_task_that_got_lost_is_posted_again_and_that_is_told(capsys):
    wire = FakeWire(misses=3)
    desk = Desk(wire, SIDE)
    desk.wait(desk.post())

    assert [task.id for task in wire.posted] == ["A1"] * 4
    assert desk.posted_again == 3
    assert capsys.readouterr().err == "A1 is posted again; nothing was heard of it\n" * 3


def test_a_task_that_waits_is_told_from_one_that_got_lost(capsys):
    wire = FakeWire(says=TaskState.WAITING)
    desk = Desk(wire, SIDE)
    desk.post()
    wire.says = TaskState.ASSIGNED
    desk.wait(["A1"])

    assert capsys.readouterr().err == "A1 is posted again; it waits\n"


def test_a_task_that_nobody_takes_is_told():
    desk = Desk(FakeWire(says=TaskState.WAITING), SIDE)

    with pytest.raises(LiveHiveError, match="2 of 2 tasks not assigned in 0 s"):
        desk.wait(desk.post(2), NO_TIME)


def test_all_tasks_are_cancelled_until_each_has_ended():
    wire = FakeWire()
    desk = Desk(wire, SIDE)
    desk.post(2)
    wire.misses = 3
    desk.clear()
    desk.clear()

    assert sorted(wire.cancelled) in (
        ["A1", "A1", "A1", "A2", "A2"],
        ["A1", "A1", "A2", "A2", "A2"],
    )


def test_ports_are_free_and_differ(monkeypatch):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        monkeypatch.setattr(zenoh_hive, "_PORTS", [port, *free_ports(3)])
        found = free_ports(3)
        with pytest.raises(LiveHiveError, match="3 ports are free; 4 are needed"):
            free_ports(4)

    assert port not in found
    assert len(set(found)) == 3
