# SPDX-License-Identifier: BSD-3-Clause
"""Saved results hold every file of the user's from which they were made."""

import shutil
from pathlib import Path

import pytest

from hive_common.map_file import load_map
from hive_common.resources import package_folder
from hive_lab.compare.experiment import read_experiment
from hive_lab.compare.sources import sources_of

FLEET = """\
robots:
  - {name: robot1, model: ./models/mir100.yaml, pose: [2.6, 2.0, 0.0]}
  - {name: robot2, model: ./others/mir100.yaml, pose: [2.6, 4.0, 0.0]}
  - {name: robot3, model: ld60, pose: [2.6, 6.0, 0.0]}
"""
SCENARIO = """\
description: A short way.
world: ../mine/hall.yaml
map: ../mine/maps/hall.yaml
fleet: ../mine/fleet.yaml
tasks:
  - {id: A, type: GA, goals: [dock]}
"""
LOAD = "fleet: ./fleet.yaml\nload: {at_once: 3}\nworld: ./hall.yaml\nmap: ./maps/hall.yaml\n"


@pytest.fixture
def mine(tmp_path):
    """Return a folder with files of a user's own, whose map has its image in another one."""
    folder = tmp_path / "mine"
    for name in ("models", "others", "maps"):
        (folder / name).mkdir(parents=True)
    simenv, models = package_folder("simenv"), package_folder("robot_description") / "models"
    world = (simenv / "worlds" / "lab.yaml").read_text(encoding="utf-8")
    station = "stations:\n  - {name: dock, pose: [3.6, 2.0, 0.0]}\n"
    (folder / "hall.yaml").write_text(world.replace("stations:\n", station), encoding="utf-8")
    chart = (simenv / "maps" / "lab.yaml").read_text(encoding="utf-8")
    (folder / "maps" / "hall.yaml").write_text(chart.replace("lab.pgm", "../floor.pgm"), "utf-8")
    shutil.copy(simenv / "maps" / "lab.pgm", folder / "floor.pgm")
    model = (models / "mir100.yaml").read_text(encoding="utf-8")
    (folder / "models" / "mir100.yaml").write_text(model, encoding="utf-8")
    (folder / "others" / "mir100.yaml").write_text(f"# another\n{model}", encoding="utf-8")
    (folder / "fleet.yaml").write_text(FLEET, encoding="utf-8")
    (folder / "tasks.yaml").write_text(SCENARIO, encoding="utf-8")
    return folder


def moved(mine, text, tmp_path):
    """Return an experiment from its sources when the user's files are gone.

    Returns:
        Its runs and what they posted before; the experiment that its sources make, and their
        folder.
    """
    path = mine / "experiment.yaml"
    path.write_text(text, encoding="utf-8")
    experiment = read_experiment(str(path))
    runs, before = experiment.runs, experiment.scenario_of(1)
    folder = tmp_path / "results"
    for name, content in sources_of(experiment).items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    shutil.rmtree(mine)
    again = read_experiment(str(folder / "experiment.yaml"))
    return runs, before, again, folder


@pytest.mark.parametrize(
    "text", [LOAD, "fleet: ./fleet.yaml\nscenario: ./tasks.yaml\n"], ids=["load", "scenario"]
)
def test_an_experiment_can_be_repeated_when_the_files_of_its_user_are_gone(mine, text, tmp_path):
    runs, before, again, folder = moved(mine, text, tmp_path)

    after = again.scenario_of(1)
    assert after.tasks == before.tasks
    assert (folder / "worlds" / "hall.yaml").samefile(after.world)
    assert (folder / "maps" / "hall.yaml").samefile(after.map)
    assert load_map(after.map).blocked.shape == load_map("lab").blocked.shape
    assert again.runs == runs
    assert again.fleet_of(again.variants[0]).robots[2].model == "ld60"


def test_two_files_of_one_name_are_both_kept(mine, tmp_path):
    *_, again, _folder = moved(mine, LOAD, tmp_path)

    first, second, _ = again.fleet_of(again.variants[0]).robots
    texts = [Path(robot.model).read_text(encoding="utf-8") for robot in (first, second)]
    assert texts[1] == f"# another\n{texts[0]}"


def test_files_that_come_along_are_named_and_not_copied(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("fleet: lab\nscenario: demo\n", encoding="utf-8")

    assert set(sources_of(read_experiment(str(path)))) == {"experiment.yaml", "fleet.yaml"}
