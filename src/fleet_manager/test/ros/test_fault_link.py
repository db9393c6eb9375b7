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


HOSTED = ("/hall/robot1/robot", "/hall/robot2/robot")


@pytest.fixture
def beat():
    """The heartbeat of robot1, in a process that hosts two robots of five members."""
    others = ["/hall/blackboard", "/hall/robot3/robot", "/hall/robot30/robot"]
    return SimpleNamespace(
        active=HOSTED[0],
        members=[*HOSTED, *others],
        _connection_header={"callerid": "/hall/robot_host_1"},
    )


@pytest.fixture
def killed(monkeypatch, beat):
    """What is killed."""
    node, pids = "/hall/robot_host_1", []
    heard = [[f"/hall/{robot}/set_state", [node]] for robot in ("robot1", "robot2")]
    others = [["/hall/robot3/set_state", ["/hall/robot_host_2"]], ["/hall/new_task", [node]]]
    state = SimpleNamespace(getSystemState=lambda: ([], [*heard, *others], []))
    monkeypatch.setattr(fault_link, "_master", lambda: state)
    monkeypatch.setattr(
        fault_link, "_pid", lambda _, asked: {node: 77, "/hall/blackboard": 5}[asked]
    )
    monkeypatch.setattr(fault_link.os, "kill", lambda pid, number: pids.append((pid, int(number))))
    monkeypatch.setattr(fault_link.rospy, "init_node", lambda *_, **__: None)
    monkeypatch.setattr(fault_link.rospy, "wait_for_message", lambda *_, **__: beat)
    return pids


def test_the_process_that_sends_the_heartbeats_is_killed_and_whom_it_hosts_is_said(killed):
    told = fault_link.RosFaultLink().kill_leader()

    assert killed == [(77, 9)]
    assert told == (
        "killed the leader hall/robot1/robot, process 77, with every robot of hall/robot_host_1"
    )


def test_a_leader_is_not_killed_with_so_many_members_that_no_majority_is_left(killed, beat):
    beat.members.remove("/hall/robot30/robot")

    with pytest.raises(InputError) as refusal:
        fault_link.RosFaultLink().kill_leader()

    assert killed == []
    assert str(refusal.value) == (
        "the leader hall/robot1/robot is not killed: its process 77 carries 2 of 4 members "
        "(hall/robot1/robot, hall/robot2/robot); 3 are needed to go on, and only 2 would be left: "
        "start the fleet with processes:=each"
    )


def test_a_leader_with_a_process_of_its_own_is_killed_alone(killed, beat):
    beat.active = beat._connection_header["callerid"] = "/hall/blackboard"  # noqa: SLF001  (rospy's)
    beat.members[:] = ["/hall/blackboard", *HOSTED]

    told = fault_link.RosFaultLink().kill_leader()

    assert (killed, told) == ([(5, 9)], "killed the leader hall/blackboard, process 5")


def test_where_no_leader_is_heard_nothing_is_killed(killed, monkeypatch):
    def nobody(*_, **__):
        raise fault_link.rospy.ROSException("timeout")

    monkeypatch.setattr(fault_link.rospy, "wait_for_message", nobody)

    with pytest.raises(InputError, match="no leader is heard within 5 s"):
        fault_link.RosFaultLink().kill_leader()
    assert killed == []
