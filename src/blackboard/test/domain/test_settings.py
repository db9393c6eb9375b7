# SPDX-License-Identifier: BSD-3-Clause
"""What users may set, and that the manual to it tells the truth."""

from dataclasses import fields
from pathlib import Path

import pytest
import yaml

from blackboard.domain.settings import (
    BlackboardSettings,
    ControllerSettings,
    PathSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.errors import SettingsError

CONFIG = Path(__file__).resolve().parents[2] / "config"
KINDS = {
    "blackboard": (BlackboardSettings, RaftSettings, PathSettings),
    "robot": (RobotSettings, ControllerSettings, PathSettings),
}
NUMBERS = [
    (kind, each.name)
    for kinds in KINDS.values()
    for kind in kinds
    for each in fields(kind)
    if not isinstance(each.default, str)
]


@pytest.mark.parametrize(("kind", "name"), NUMBERS)
@pytest.mark.parametrize("bad", [0, -1.0, float("nan"), float("inf")])
def test_a_number_that_is_not_above_nothing_is_refused_by_its_name(kind, name, bad):
    with pytest.raises(SettingsError, match=f"{name} is {bad!r}; allowed: above 0"):
        kind(**{name: bad})


def test_an_unknown_cost_model_is_refused_with_those_there_are():
    with pytest.raises(SettingsError, match="'cheap'; allowed: report, energy, time"):
        RobotSettings(cost_model="cheap")


def test_an_unknown_distance_is_refused_with_those_there_are():
    with pytest.raises(SettingsError, match="'guess'; allowed: path, euclidean"):
        PathSettings(distance="guess")


@pytest.mark.parametrize("file", KINDS)
def test_the_parameter_file_holds_every_setting_with_its_default(file):
    manual = yaml.safe_load((CONFIG / f"{file}.yaml").read_text())
    defaults = {each.name: each.default for kind in KINDS[file] for each in fields(kind)}
    for name in ("charge", "stands_by"):  # of its battery and its member, not settings
        manual.pop(name, None)

    assert manual == defaults


@pytest.mark.parametrize("file", KINDS)
def test_the_parameter_file_explains_every_key_in_a_comment_above_it(file):
    lines = (CONFIG / f"{file}.yaml").read_text().splitlines()
    keys = [number for number, line in enumerate(lines) if line and not line.startswith("#")]

    assert all(lines[number - 1].startswith("#") for number in keys)
