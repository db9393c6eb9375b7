# SPDX-License-Identifier: BSD-3-Clause
"""The one xacro file, expanded for every model without ROS."""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import pytest

pytest.importorskip("xacro")

from robot_description.describe import main
from robot_description.models import load_model, model_names, model_path
from robot_description.urdf import robot_urdf

if TYPE_CHECKING:
    from pathlib import Path

ARM_LINKS = {"robot1/arm_base", "robot1/arm_upper", "robot1/arm_fore", "robot1/gripper"}


def links(model: str) -> set[str]:
    root = ET.fromstring(robot_urdf(model, "robot1/"))  # noqa: S314  (our own text)
    return {str(link.get("name")) for link in root.findall("link")}


@pytest.mark.parametrize("model", model_names())
def test_every_link_bears_the_robots_prefix(model: str) -> None:
    expected = {"robot1/base_footprint", "robot1/base_link", "robot1/laser"}

    assert links(model) - ARM_LINKS == expected


@pytest.mark.parametrize("model", model_names())
def test_only_a_mobile_manipulator_has_arm_links(model: str) -> None:
    has_arm = load_model(model).arm is not None

    assert links(model) & ARM_LINKS == (ARM_LINKS if has_arm else set())


@pytest.mark.parametrize("model", model_names())
def test_links_form_one_tree_below_base_footprint(model: str) -> None:
    root = ET.fromstring(robot_urdf(model, "robot1/"))  # noqa: S314  (our own text)
    children = [joint.find("child").get("link") for joint in root.findall("joint")]  # type: ignore[union-attr]  # every joint has a child

    assert sorted(children) == sorted(links(model) - {"robot1/base_footprint"})


def test_the_base_is_as_large_as_the_footprint() -> None:
    root = ET.fromstring(robot_urdf("ld60"))  # noqa: S314  (our own text)
    box = root.find("link[@name='base_link']/collision/geometry/box")

    assert box is not None
    assert [round(float(size), 3) for size in box.get("size", "").split()] == [0.7, 0.5, 0.363]


def test_the_command_prints_the_checked_model_file(capsys: Any) -> None:
    assert main(["characteristics", "--model", "youbot"]) == 0
    assert "name: youbot" in capsys.readouterr().out


def test_the_command_tells_an_unknown_model_without_a_traceback(capsys: Any) -> None:
    assert main(["urdf", "--model", "r2d2"]) == 1
    assert capsys.readouterr().err.startswith("describe_robot: robot model 'r2d2': not known")


@pytest.mark.parametrize("name", ["my_dingo.yaml", "it's $(mine) ${too}.yaml"])
def test_a_model_file_is_found_from_where_the_user_stands(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    shutil.copy(model_path("dingo"), tmp_path / name)
    monkeypatch.chdir(tmp_path)

    assert main(["urdf", "--model", f"./{name}"]) == 0
    assert capsys.readouterr().out == robot_urdf("dingo")
