# SPDX-License-Identifier: BSD-3-Clause
import subprocess
import sys
from pathlib import Path

import pytest

from fleet_manager.ros.launch_arguments import complaint

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
    assert f"launch_arguments $(dirname)/{file}" in (LAUNCH / file).read_text()


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
