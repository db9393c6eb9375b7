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
