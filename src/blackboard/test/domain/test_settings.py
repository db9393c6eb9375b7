# SPDX-License-Identifier: BSD-3-Clause
"""What users may set."""

import pytest
from attrs import fields

from blackboard.domain.settings import (
    BlackboardSettings,
    ChargingSettings,
    ControllerSettings,
    PathSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.errors import SettingsError

KINDS = (
    BlackboardSettings,
    ChargingSettings,
    ControllerSettings,
    PathSettings,
    RaftSettings,
    RobotSettings,
)
NUMBERS = [
    (kind, each.name)
    for kind in KINDS
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
