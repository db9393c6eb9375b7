# SPDX-License-Identifier: BSD-3-Clause
"""Where a node keeps its journal if no parameter says where."""

import socket

import pytest

pytest.importorskip("rospy", reason="needs ROS")

from blackboard.ros.journals import default_folder


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", socket.gethostname()])
def test_all_names_of_this_machine_lead_to_one_folder(host, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://{host}:11311")

    assert default_folder() == tmp_path / "robo-hive" / "localhost-11311"


def test_masters_on_other_machines_and_ports_have_their_own(monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_MASTER_URI", "http://robot.invalid:11322")

    assert default_folder() == tmp_path / "robo-hive" / "robot.invalid-11322"
