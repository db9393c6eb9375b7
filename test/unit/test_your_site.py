# SPDX-License-Identifier: BSD-3-Clause
"""docs/your-site.md is right: its files, its reference of keys, and its fast commands.

`test/rostest/your_site.test` runs all of its commands in a hive.
"""

import importlib
import re
import sys
from pathlib import Path

import attrs
import pytest

from fleet_manager.cli.main import run
from fleet_manager.config.fleet_file import FleetContent, FleetRobot
from simenv.world.world_content import (
    Circle,
    DoorEntry,
    Person,
    Place,
    Segment,
    Station,
    WorldContent,
)

CASES = Path(__file__).resolve().parents[1] / "rostest" / "cases"
sys.path.insert(0, str(CASES))
site_page = importlib.import_module("site_page")
sys.path.pop(0)

COMMANDS = site_page.commands()
OF_A_RUNNING_HIVE = (
    *(["./hive", "shell"], ["export", "ROS_MASTER_URI=..."], ["hive", "robots"], ["hive", "why"]),
    *(["hive", "add"], ["roslaunch", "fleet_manager"], ["rosparam", "set"], ["mkdir", "-p"]),
)
"""The first two words of commands that only the case on ROS runs."""
WORLD = [words[1:] for words in COMMANDS if words[:2] == ["hive", "world"]]
CHECKS = [words[3:] for words in COMMANDS if words[:2] == ["rosrun", "fleet_manager"]]


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Stand in a folder with the files of the page."""
    site_page.save_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_every_command_of_the_page_is_run_by_a_test():
    fast = len(WORLD) + len(CHECKS)
    slow = sum(words[:2] in OF_A_RUNNING_HIVE for words in COMMANDS)

    assert (len(WORLD), len(CHECKS)) == (2, 2)
    assert fast + slow == len(COMMANDS)


def test_the_world_is_good_and_its_map_is_drawn(site, capsys):
    assert [run(None, words) for words in WORLD] == [0, 0]
    assert "good. 'my hall'" in capsys.readouterr().out
    assert {file.name for file in (site / "my_site").iterdir()} == {
        *("world.yaml", "map.yaml", "map.pgm", "fleet.yaml", "real_fleet.yaml")
    }


@pytest.mark.usefixtures("site")
@pytest.mark.parametrize("words", CHECKS, ids=" ".join)
def test_the_fleets_are_good(words, capsys):
    program = pytest.importorskip("fleet_manager.ros.launch_fleet", reason="needs ROS")
    for each in WORLD:
        run(None, each)
    capsys.readouterr()

    program.launch_fleet.main(words, standalone_mode=False)
    said = capsys.readouterr()

    assert ": good. 2 robots, 2 chargers, 0 zones" in said.out
    assert said.err == ""


def named(heading):
    """Return the keys in the first column of the tables below a heading."""
    page = site_page.PAGE.read_text(encoding="utf-8")
    below = page[page.index(f"### {heading}") + 4 :].partition("\n#")[0]
    rows = [line.split("|")[1] for line in below.splitlines() if line.startswith("| `")]
    return {key for row in rows for key in re.findall(r"`(\w+)`", row)}


def keys(*classes):
    """Return the keys of a file, which are the fields of classes."""
    return {field.name.rstrip("_") for each in classes for field in attrs.fields(each)}


def test_the_page_explains_every_key_of_a_world_file_and_no_other():
    inside = keys(Circle, Segment) | {"open"}
    entries = keys(DoorEntry, Place, Station, Person) - {"open", "name"}
    page = site_page.PAGE.read_text(encoding="utf-8")

    assert named("Keys of a world file") == keys(WorldContent) | entries | {"radius"}
    assert [key for key in inside if f"{key}: " not in page] == []


def test_the_page_explains_every_key_of_a_fleet_file_and_no_other():
    assert named("Keys of a fleet file") == keys(FleetContent, FleetRobot)
