# SPDX-License-Identifier: BSD-3-Clause
"""What an AGV is: its factsheet as a robot model, and what a model file says in its place."""

import attrs
import pytest

from blackboard.domain.characteristics import characteristics_from
from hive_common.structuring import NotAllowedError, structure
from robot_description.models import RobotModel, load_model
from vda5050.agent.body import model_of
from vda5050.connector.arm_tools import ArmTools
from vda5050.connector.testing import FakeArm
from vda5050.protocol.factsheet import RobotAction
from vda5050.vehicle.factsheet import factsheet_of


def sheet_of(name):
    model = load_model(name)
    return factsheet_of(model, ArmTools(model, FakeArm() if model.arm else None), "AUTONOMOUS")


@pytest.mark.parametrize("name", ["mir100", "ld60", "fetch"])
def test_size_speed_and_load_are_those_of_the_factsheet(name):
    model, told = load_model(name), structure(model_of(sheet_of(name), {}), RobotModel)

    assert told.base.max_speed == model.base.max_speed
    assert told.base.acceleration == model.base.acceleration
    assert told.payload == model.payload
    size = [max(ends) - min(ends) for ends in zip(*told.base.footprint, strict=True)]
    assert size == pytest.approx(
        [max(ends) - min(ends) for ends in zip(*model.base.footprint, strict=True)]
    )
    assert characteristics_from(model_of(sheet_of(name), {})).payload == model.payload


def test_a_model_file_goes_before_the_factsheet_part_by_part():
    file = {"payload": 40.0, "base": {"max_speed": 0.7}}
    told = structure(model_of(sheet_of("mir100"), file), RobotModel)

    assert (told.payload, told.base.max_speed) == (40.0, 0.7)
    assert told.base.acceleration == load_model("mir100").base.acceleration


def test_only_an_agv_that_picks_and_drops_carries_by_itself():
    sheet = sheet_of("mir100")
    assert model_of(sheet, {})["capabilities"] == ["GA", "GAB"]
    handles = attrs.evolve(
        sheet.protocol_features,
        mobile_robot_actions=(RobotAction("pick"), RobotAction("drop")),
    )
    able = model_of(attrs.evolve(sheet, protocol_features=handles), {})

    assert able["capabilities"] == ["GA", "GAB", "GPA", "GPAB"]
    assert structure(able, RobotModel).arm.payload == sheet.type_specification.maximum_load_mass


def test_without_a_factsheet_a_part_of_a_model_is_not_enough():
    with pytest.raises(NotAllowedError):
        structure(model_of(None, {"payload": 40.0}), RobotModel)
