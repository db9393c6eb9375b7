# SPDX-License-Identifier: BSD-3-Clause
"""`hive fault` finds the nodes of a robot in the namespace of its hive."""

from types import SimpleNamespace

import pytest

pytest.importorskip("simenv.msg", reason="the link needs generated messages")

from fleet_manager.errors import InputError
from fleet_manager.ros import fault_link


@pytest.fixture
def master(monkeypatch):
    """A ROS master that knows two hives, each with a robot1; a node's process has its length."""
    monkeypatch.setattr(fault_link, "_pid", lambda _master, node: len(node))
    heard = [["/tf", ["/robot1/robot", "/hall/robot1/move_base", "/hall/robot10/robot"]]]
    shared = [["/hall/robot2/cmd_vel", ["/hall/robot_host_1"]]]
    return SimpleNamespace(getSystemState=lambda: (shared, heard, []))


@pytest.mark.parametrize(
    ("namespace", "node"), [("", "/robot1/robot"), ("hall", "/hall/robot1/move_base")]
)
def test_the_processes_of_a_robot_are_those_in_the_namespace(master, monkeypatch, namespace, node):
    monkeypatch.setenv("ROS_NAMESPACE", namespace)

    assert fault_link._pids(master, "robot1") == [len(node)]  # noqa: SLF001  (who is stopped)


def test_a_robot_that_shares_its_process_is_not_stopped(master, monkeypatch):
    monkeypatch.setenv("ROS_NAMESPACE", "hall")

    with pytest.raises(InputError, match="shares its process with others"):
        fault_link._pids(master, "robot2")  # noqa: SLF001  (as above)


@pytest.fixture
def killed(monkeypatch):
    """What is killed, where the leader is robot1 in a process that hosts several robots."""
    beat = SimpleNamespace(
        active="/robot1/robot", _connection_header={"callerid": "/robot_host_1"}
    )
    pids = []
    monkeypatch.setattr(fault_link, "_master", lambda: None)
    monkeypatch.setattr(fault_link, "_pid", lambda _master, node: {"/robot_host_1": 77}[node])
    monkeypatch.setattr(fault_link.os, "kill", lambda pid, number: pids.append((pid, int(number))))
    monkeypatch.setattr(fault_link.rospy, "init_node", lambda *_, **__: None)
    monkeypatch.setattr(fault_link.rospy, "wait_for_message", lambda *_, **__: beat)
    return pids


def test_the_process_that_sends_the_heartbeats_is_killed_and_whom_it_hosts_is_said(killed):
    told = fault_link.RosFaultLink().kill_leader()

    assert killed == [(77, 9)]
    assert told == "killed the leader robot1/robot, process 77, with every robot of robot_host_1"


def test_where_no_leader_is_heard_nothing_is_killed(killed, monkeypatch):
    def nobody(*_, **__):
        raise fault_link.rospy.ROSException("timeout")

    monkeypatch.setattr(fault_link.rospy, "wait_for_message", nobody)

    with pytest.raises(InputError, match="no leader is heard within 5 s"):
        fault_link.RosFaultLink().kill_leader()
    assert killed == []
