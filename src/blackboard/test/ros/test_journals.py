# SPDX-License-Identifier: BSD-3-Clause
"""Where a node keeps its journal if no parameter says where."""

import socket

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rosgraph

from blackboard.errors import SettingsError
from blackboard.ros.journals import default_folder, named_folder
from blackboard.ros.membership import journal_folder


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", socket.gethostname()])
def test_all_names_of_this_machine_lead_to_one_folder(host, monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_MASTER_URI", f"http://{host}:11311")

    assert default_folder() == tmp_path / "robo-hive" / "localhost-11311"


def test_masters_on_other_machines_and_ports_have_their_own(monkeypatch, tmp_path):
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setenv("ROS_MASTER_URI", "http://robot.invalid:11322")

    assert default_folder() == tmp_path / "robo-hive" / "robot.invalid-11322"


@pytest.mark.parametrize(
    ("known", "folder"),
    [
        ({"/journal": "/all"}, "/all"),
        ({"/journal": "/all", "/hall/journal": "/hall"}, "/hall"),
        ({"/hall/robot1/robot/journal": "/own", "/hall/journal": "/hall"}, "/own"),
        ({"/other/journal": "/other"}, ""),
    ],
)
def test_the_parameter_nearest_to_a_member_names_its_folder(monkeypatch, known, folder):
    class Master:
        def __init__(self, caller):
            self._caller = caller

        def searchParam(self, key):  # noqa: N802  (rosgraph's name)
            spaces = self._caller.split("/")
            for length in range(len(spaces), 0, -1):
                if (name := "/".join([*spaces[:length], key])) in known:
                    return name
            raise rosgraph.MasterError("not set")

        def getParam(self, key):  # noqa: N802  (rosgraph's name)
            return known[key]

    monkeypatch.setattr(rosgraph, "Master", Master)

    assert named_folder("/hall/robot1/robot") == folder


def test_a_master_that_does_not_answer_names_no_folder_and_is_no_master_without_the_parameter(
    monkeypatch,
):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")

    with pytest.raises(OSError, match="refused"):
        named_folder("/robot1/robot")


def test_a_member_does_not_start_on_another_journal_because_no_master_answers(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")

    with pytest.raises(SettingsError, match="does not say where the journal is"):
        journal_folder("/robot1/robot")


@pytest.mark.parametrize("failure", [rosgraph.MasterFailure("odd answer"), OSError("gone")])
def test_a_master_that_fails_is_told_apart_from_one_without_the_parameter(monkeypatch, failure):
    def fail(*_):
        raise failure

    monkeypatch.setattr(rosgraph.Master, "searchParam", fail)

    with pytest.raises(OSError, match=str(failure)):
        named_folder("/robot1/robot")


def test_a_folder_that_is_no_text_is_refused(monkeypatch):
    class Master:
        def __init__(self, _caller):
            pass

        def searchParam(self, _key):  # noqa: N802  (rosgraph's name)
            return "/journal"

        def getParam(self, _key):  # noqa: N802  (rosgraph's name)
            return 7

    monkeypatch.setattr(rosgraph, "Master", Master)

    with pytest.raises(SettingsError, match="journal is 7"):
        named_folder("/robot1")
