# SPDX-License-Identifier: BSD-3-Clause
"""Robot models: what the default ones promise, and what a bad file is told."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import pytest
import yaml

from hive_common.errors import FileError
from hive_common.resources import package_folder
from robot_description.models import load_model, model_names

DOOR_WIDTH = 1.2  # [m], the doors of the lab


def written(tmp_path: Any, change: Any) -> Any:
    """Return the path of the mir100 file after `change(content)`."""
    content = yaml.safe_load(
        (package_folder("robot_description") / "models/mir100.yaml").read_text()
    )
    change(content)
    path = tmp_path / "changed.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


def test_there_are_two_agvs_two_amrs_two_mobile_manipulators_and_one_that_walks() -> None:
    kinds = Counter(load_model(name).kind for name in model_names())

    assert kinds == {"agv": 2, "amr": 2, "mobile_manipulator": 2, "legged": 1}


def test_the_robot_that_the_guide_adds_is_described_without_a_mistake(tmp_path: Any) -> None:
    guide = package_folder("robot_description").parents[1] / "docs/adding-a-robot.md"
    path = tmp_path / "dingo_o.yaml"
    path.write_text(guide.read_text(encoding="utf-8").split("```yaml\n")[1].split("```")[0])

    model = load_model(path)

    assert model.name == "dingo_o"
    assert model.name not in model_names()


def test_one_default_model_is_holonomic_and_one_agv_is_differential() -> None:
    models = [load_model(name) for name in model_names()]

    assert any(model.base.holonomic for model in models)
    assert any(model.base.drive == "differential" and model.arm is None for model in models)


@pytest.mark.parametrize("name", model_names())
def test_a_default_model_is_named_like_its_file_and_says_its_source(name: str) -> None:
    model = load_model(name)

    assert model.name == name
    assert any(part.strip().isdigit() for part in model.source.split(","))


@pytest.mark.parametrize("name", sorted(set(model_names()) - {"spot"}))
def test_a_default_model_on_wheels_can_turn_on_the_spot_in_a_door(name: str) -> None:
    assert 2 * load_model(name).base.circumscribed_radius < DOOR_WIDTH - 0.1


@pytest.mark.parametrize("name", model_names())
def test_only_a_model_with_an_arm_can_pick(name: str) -> None:
    model = load_model(name)

    assert (model.arm is not None) == ("GPA" in model.capabilities)
    assert (model.arm is not None) == ("pick" in model.interfaces)


def test_radii_follow_from_the_footprint() -> None:
    base = load_model("mir100").base

    assert base.inscribed_radius == pytest.approx(0.29)
    assert base.circumscribed_radius == pytest.approx(math.hypot(0.445, 0.29))


def test_an_unknown_name_is_told_the_known_ones() -> None:
    with pytest.raises(FileError, match=r"'mir1000': not known; allowed: dingo, fetch, ld60"):
        load_model("mir1000")


def test_a_model_can_be_read_from_a_path(tmp_path: Any) -> None:
    path = written(tmp_path, lambda content: content.update(payload=70.0))

    assert load_model(path).payload == 70.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c["base"].update(mass=-3), r"changed.yaml:\d+: base.mass: -3; allowed: mass"),
        (
            lambda c: c["base"].update(drive="tracks"),
            r"base.drive: 'tracks'; allowed: .*holonomic",
        ),
        (lambda c: c.update(capabilities=["FLY"]), r"capabilities.*'FLY'.*GPAB"),
        (lambda c: c.pop("battery"), r":1: battery: missing; allowed: the keys capacity"),
        (lambda c: c.update(colour="red"), r":\d+: colour: unknown; allowed: the keys name, kind"),
        (lambda c: c["base"]["footprint"].reverse(), r"base.footprint: .*counter-clockwise"),
        (lambda c: c["base"].update(max_speed_diagonal=1.0), r"max_speed_diagonal: 1.0 with"),
        (lambda c: c["base"].update(drive="holonomic"), r"max_speed_diagonal: None with"),
        (lambda c: c["battery"].update(voltage_full=20), r"voltage_full: 20 V is not above"),
        (lambda c: c["laser"].update(range_max=0.05), r"range_max: 0.05 m is not above"),
        (lambda c: c.update(kind="boat"), r":\d+: kind: 'boat'; allowed: agv \| amr .* legged"),
        (lambda c: c.update(kind="mobile_manipulator"), r"kind: mobile_manipulator with no arm"),
        (lambda c: c.update(sensors="eyes"), r":\d+: sensors: 'eyes'; allowed: a list of names"),
        (lambda c: c.update(capabilities=["GPA"]), r"capabilities: GPA need an arm"),
        (lambda c: c["base"].update(max_speed=math.nan), r":\d+: \.nan is not a number"),
        (lambda c: c["base"].update(max_speed=math.inf), r":\d+: \.inf is not a number"),
    ],
)
def test_a_bad_file_is_told_the_key_and_what_is_allowed(
    tmp_path: Any, change: Any, message: str
) -> None:
    path = written(tmp_path, change)

    with pytest.raises(FileError, match=message):
        load_model(path)
