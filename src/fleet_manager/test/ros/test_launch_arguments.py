# SPDX-License-Identifier: BSD-3-Clause
import contextlib
import re
import subprocess
import sys
import threading
from pathlib import Path
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from fleet_manager.ros.launch_arguments import clash, complaint

LAUNCH = Path(__file__).resolve().parents[2] / "launch"
ROBOT = LAUNCH / "robot.launch"
COMMAND = ["/usr/bin/python3", "/usr/bin/roslaunch", "fleet_manager", "robot.launch"]


def test_arguments_that_a_launch_file_has_are_taken():
    assert complaint(ROBOT, [*COMMAND, "name:=robot5", "navigation:=none"]) == ""


def test_an_argument_that_it_does_not_have_is_named_with_those_that_it_has():
    said = complaint(ROBOT, [*COMMAND, "name:=robot5", "navigate:=none"])

    assert said.startswith("robot.launch: argument 'navigate' is unknown; allowed: charge,")
    assert "navigation" in said
    assert "\n" not in said


def test_an_argument_that_a_launch_file_sets_itself_cannot_be_given():
    file = LAUNCH / "fleet_manager.launch"

    said = complaint(file, ["roslaunch", str(file), "world_file:=/tmp/mine.yaml"])

    assert "argument 'world_file' is unknown" in said


def test_names_of_roslaunch_itself_are_taken():
    assert complaint(ROBOT, [*COMMAND, "__ns:=east"]) == ""


def test_a_file_that_includes_it_answers_for_its_own_arguments():
    assert complaint(ROBOT, ["roslaunch", "mine", "mine.launch", "colour:=red"]) == ""


@pytest.mark.parametrize(
    ("choice", "said"),
    [
        ("navigation:ours|none:none", ""),
        (
            "navigation:ours|none:theirs",
            "robot.launch: navigation: 'theirs'; allowed: ours | none",
        ),
    ],
)
def test_a_value_that_is_not_allowed_is_named(choice, said):
    assert complaint(ROBOT, ["roslaunch", "-"], [choice]) == said


@pytest.mark.parametrize("file", ["robot.launch", "fleet_manager.launch"])
def test_the_launch_files_for_users_have_their_own_arguments_checked(file):
    check = rf"/launch_arguments ('--robot=[^']*' )?\$\(dirname\)/{file}"

    assert re.search(check, (LAUNCH / file).read_text())


@pytest.mark.parametrize(("word", "code"), [("name:=robot5", 0), ("colour:=red", 2)])
def test_the_words_are_those_of_the_process_that_loads_the_file(word, code):
    check = "import sys; from fleet_manager.ros.launch_arguments import main; sys.exit(main())"
    load = (
        "import subprocess, sys; sys.exit(subprocess.run("
        f"[sys.executable, '-c', {check!r}, {str(ROBOT)!r}]).returncode)"
    )
    source = LAUNCH.parent / "src"

    done = subprocess.run(
        [sys.executable, "-c", load, "robot.launch", word],
        env={"PYTHONPATH": str(source)},
        capture_output=True,
        text=True,
        check=False,
    )

    assert done.returncode == code
    assert ("argument 'colour' is unknown" in done.stderr) is (code != 0)


@contextlib.contextmanager
def serving(**calls):
    """Answer XML-RPC calls; give the address."""
    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        for name, call in calls.items():
            server.register_function(call, name)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


@pytest.fixture
def node():
    """The address of a node that answers."""
    with serving(getPid=lambda _caller: (1, "", 4711)) as address:
        yield address


@pytest.fixture
def master(monkeypatch):
    """What a ROS master knows: who listens to which topic, and where each node is."""
    listeners, addresses = {}, {}
    with serving(
        getSystemState=lambda _caller: (1, "", [[], list(listeners.items()), []]),
        lookupNode=lambda _caller, name: (1, "", addresses[name]),
    ) as address:
        monkeypatch.setenv("ROS_MASTER_URI", address)
        yield listeners, addresses


def test_a_robot_that_runs_already_is_not_started_again(master, node):
    master[0]["/robot5/set_state"] = ["/robot5/robot"]
    master[1]["/robot5/robot"] = node

    assert clash("robot5") == (
        "robot5 runs already: the node /robot5/robot speaks for it; end its nodes first, or "
        "choose another name"
    )
    assert clash("robot6") == ""


def test_a_robot_whose_process_was_killed_is_started_again(master):
    master[0]["/robot5/set_state"] = ["/robot5/robot"]
    master[1]["/robot5/robot"] = "http://127.0.0.1:1"

    assert clash("robot5") == ""


def test_a_robot_of_that_name_in_another_namespace_is_another_robot(master, node, monkeypatch):
    master[0]["/hall/robot5/set_state"] = ["/hall/robot5/robot"]
    master[1]["/hall/robot5/robot"] = node

    assert clash("robot5") == ""
    monkeypatch.setenv("ROS_NAMESPACE", "hall")
    assert clash("robot5").startswith("robot5 runs already")


def test_without_a_master_no_robot_runs(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")

    assert clash("robot5") == ""
