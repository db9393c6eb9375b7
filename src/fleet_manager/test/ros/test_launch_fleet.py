# SPDX-License-Identifier: BSD-3-Clause
import json

import pytest

pytest.importorskip("roslaunch", reason="needs ROS")

from fleet_manager.ros.launch_fleet import launch_fleet

ZONE = "zones: [{name: door, kind: keep-out, corners: [[1, 1], [2, 1], [2, 2]]}]"
ROBOTS = "robots: [{name: robot1, model: mir100, pose: [5.0, 5.0, 0.0]}]"


@pytest.fixture
def check(tmp_path, capsys):
    """Check a fleet file with some lines; return what was said beside the launch file."""

    def call(*lines, **options):
        (tmp_path / "fleet.yaml").write_text("\n".join([*lines, ROBOTS]))
        words = [f"--{name}={value}" for name, value in options.items()]
        words += ["--check", str(tmp_path / "fleet.yaml")]
        launch_fleet.main(words, standalone_mode=False)
        return capsys.readouterr().err

    return call


def test_zones_that_bind_nobody_are_told_with_the_remedy(check):
    said = check(ZONE)

    assert said.count("\n") == 1
    assert "the fleet's zones bind nobody: start with traffic:=planned" in said


@pytest.mark.parametrize(
    ("lines", "options"),
    [([ZONE, "traffic: planned"], {}), ([ZONE], {"traffic": "planned"}), ([], {})],
)
def test_nothing_is_said_where_zones_bind_or_there_are_none(check, lines, options):
    assert check(*lines, **options) == ""


def test_a_good_fleet_is_said_to_be_good_in_one_line(capsys):
    launch_fleet.main(["--check", "--world=lab", "--map=lab", "lab"], standalone_mode=False)

    said = capsys.readouterr().out
    assert said.startswith("lab: good. 4 robots, 4 chargers, 0 zones; decision planned")
    assert said.count("\n") == 1


def test_the_launch_file_is_printed_where_it_is_asked_for(capsys):
    launch_fleet.main(["--print", "--world=lab", "--map=lab", "lab"], standalone_mode=False)

    said = capsys.readouterr().out
    assert said.startswith("<launch>")
    assert said.endswith("</launch>\n")


@pytest.mark.parametrize("option", ["--check", "--print"])
def test_every_mistake_of_every_file_is_a_line_and_ends_it_with_2(tmp_path, capsys, option):
    (tmp_path / "fleet.yaml").write_text(ROBOTS.replace("[5.0, 5.0, 0.0]", "[100, 100, 0]"))
    words = [option, "--world=nowhere", "--map=lab", str(tmp_path / "fleet.yaml")]

    with pytest.raises(SystemExit) as ended:
        launch_fleet.main(words, standalone_mode=False)

    assert ended.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    world, robot = said.err.splitlines()
    assert world.startswith("launch_fleet: world 'nowhere': not known")
    assert "fleet.yaml:1: robots[0].pose: robot1 cannot start at" in robot


TWO = """
names: stock
zenoh:
  members:
    - {name: blackboard, address: "127.0.0.1:7450"}
    - {name: robot1, address: "127.0.0.1:7451"}
    - {name: robot2, address: "127.0.0.1:7452"}
robots:
  - {name: robot1, model: mir100, pose: [5, 5, 0]}
  - {name: robot2, model: mir100, pose: [8, 5, 0]}
"""


def test_two_robots_with_stock_names_are_refused_on_one_ros_master(tmp_path, capsys):
    (tmp_path / "fleet.yaml").write_text(TWO)
    with pytest.raises(SystemExit) as ended:
        launch_fleet.main(
            ["--check", "--sim=false", str(tmp_path / "fleet.yaml")], standalone_mode=False
        )

    assert ended.value.code == 2
    [line] = capsys.readouterr().err.splitlines()
    assert line.startswith("launch_fleet: names: robot1, robot2 have stock names")
    assert "machine:=robot1" in line


@pytest.mark.parametrize(
    "words", [["--sim=true"], ["--sim=false", "--transport=zenoh", "--machine=robot1"]]
)
def test_they_are_good_in_the_simulator_and_on_a_master_each(tmp_path, capsys, words):
    (tmp_path / "fleet.yaml").write_text(TWO)
    launch_fleet.main(["--check", *words, str(tmp_path / "fleet.yaml")], standalone_mode=False)

    assert capsys.readouterr().err == ""


def test_the_places_of_the_world_and_the_fleets_own_chargers_can_be_named_as_goals(
    tmp_path, capsys
):
    fleet = tmp_path / "fleet.yaml"
    fleet.write_text(f"{ROBOTS}\nchargers: [{{name: my charger, pose: [6.0, 5.0, 0.0]}}]")
    launch_fleet.main(["--print", "--world=lab", str(fleet)], standalone_mode=False)

    (line,) = (line for line in capsys.readouterr().out.splitlines() if 'param="places"' in line)
    named = json.loads(line.split(">", 1)[1].rsplit("<", 1)[0])
    assert {"name": "test cell", "pose": [17.8, 1.6, -1.5708]} in named
    assert {"name": "my charger", "pose": [6.0, 5.0, 0.0]} in named
