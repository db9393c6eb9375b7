# SPDX-License-Identifier: BSD-3-Clause
"""What a robot has learned is on the parameter server; others of its model begin with it."""

import threading

import pytest

pytest.importorskip("rospy")

import rospy

from blackboard.costing.estimator import Estimator
from blackboard.costing.saved_experience import as_plain
from blackboard.ros.learned_parameter import LearnedParameter
from hive_common.pose import Pose
from hive_common.ros.names import RobotNames
from hive_lab.virtual.hive import SMALL_ROBOT

BODY, OTHER = {"mass": 50.0}, {"mass": 70.0}


class Server:
    """Stands for the parameter server."""

    def __init__(self, monkeypatch):
        self.tree = {}
        self.gate = threading.Event()
        self.gate.set()
        self.begun = threading.Semaphore(0)
        self.written = threading.Semaphore(0)
        self.is_gone = False
        self.warnings = []
        monkeypatch.setattr(rospy, "get_param", self.get)
        monkeypatch.setattr(rospy, "set_param", self.set)
        monkeypatch.setattr(rospy, "get_param_names", self.names)
        monkeypatch.setattr(rospy, "logwarn", self.warnings.append)

    def get(self, name, default):
        if self.is_gone:
            raise OSError("connection refused")
        return self.tree.get(name, default)

    def set(self, name, value):
        self.begun.release()
        assert self.gate.wait(10.0)
        try:
            if self.is_gone:
                raise OSError("connection refused")
            self.tree[name] = value
        finally:
            self.written.release()

    def names(self):
        if self.is_gone:
            raise OSError("connection refused")
        return [f"{name}/learned" if name.endswith("learned") else name for name in self.tree]

    def add(self, robot, body, content):
        self.tree[f"/hall/{robot}/characteristics"] = body
        self.tree[f"/hall/{robot}/learned"] = content

    def of_model(self):
        """Return what robot9, a new one, finds."""
        self.tree["/hall/robot9/characteristics"] = BODY
        return list(LearnedParameter(RobotNames("/hall/", "robot9")).of_model())


@pytest.fixture
def server(monkeypatch):
    return Server(monkeypatch)


def saved(drives):
    estimator = Estimator(SMALL_ROBOT)
    for _ in range(drives):
        estimator.learn_drive(Pose(0.0, 0.0), Pose(5.0, 0.0), 5.0, 9.0)
    return estimator.save()


def test_what_was_learned_is_written_by_a_thread_of_its_own_and_only_the_newest(server):
    server.gate.clear()
    parameter = LearnedParameter(RobotNames("/hall/", "robot1"))

    parameter.tell(saved(1))
    assert server.begun.acquire(timeout=10.0)
    for drives in range(2, 5):
        parameter.tell(saved(drives))  # nobody waits for the server
    server.gate.set()
    assert server.written.acquire(timeout=10.0)
    assert server.written.acquire(timeout=10.0)

    assert server.tree == {"/hall/robot1/learned": as_plain(saved(4))}
    assert not server.written.acquire(blocking=False)


def test_a_master_that_is_gone_costs_nothing_and_the_next_write_reaches_a_new_one(server):
    parameter = LearnedParameter(RobotNames("/hall/", "robot1"))
    server.is_gone = True
    parameter.tell(saved(1))
    assert server.written.acquire(timeout=10.0)
    server.is_gone = False

    parameter.tell(saved(2))
    assert server.written.acquire(timeout=10.0)

    assert server.tree == {"/hall/robot1/learned": as_plain(saved(2))}


def test_a_new_robot_finds_the_experience_of_its_model_only(server):
    server.add("robot1", BODY, as_plain(saved(3)))
    server.add("robot2", OTHER, as_plain(saved(5)))
    server.add("robot3", BODY, as_plain(saved(7)))
    server.add("robot9", BODY, as_plain(saved(9)))  # its own, of an earlier life

    assert server.of_model() == [saved(3), saved(7)]


def test_odd_experience_is_named_and_left_out(server):
    server.add("robot1", BODY, {"learned": [1.0]})
    server.add("robot2", BODY, as_plain(saved(3)))
    server.add("robot3", BODY, "what?")

    assert server.of_model() == [saved(3)]
    assert [text.partition(":")[0] for text in server.warnings] == [
        "parameter /hall/robot1/learned is ignored",
        "parameter /hall/robot3/learned is ignored",
    ]


def test_without_a_master_a_robot_begins_with_the_formula(server):
    server.is_gone = True

    assert list(LearnedParameter(RobotNames("/hall/", "robot9")).of_model()) == []
    assert server.warnings == [
        "nothing is known of what other robots have learned: connection refused"
    ]
