# SPDX-License-Identifier: BSD-3-Clause
"""What a vehicle tells about itself, from its robot model."""

from __future__ import annotations

from typing import TYPE_CHECKING

from vda5050.protocol.factsheet import (
    ActionScope,
    Factsheet,
    LoadSet,
    LoadSpecification,
    PhysicalParameters,
    ProtocolFeatures,
    RobotAction,
    TypeSpecification,
)
from vda5050.vehicle.remote_control import OFFERED

if TYPE_CHECKING:
    from robot_description.models import RobotModel
    from vda5050.vehicle.ports import Tools


def factsheet_of(model: RobotModel, tools: Tools, navigation: str) -> Factsheet:
    """Return what a vehicle of a model tells about itself.

    Args:
        model: What it is.
        tools: What it can do besides driving.
        navigation: How it finds its way, in the standard's words.
    """
    base, arm = model.base, model.arm
    instant = (RobotAction(kind, (ActionScope.INSTANT,)) for kind in OFFERED)
    xs, ys = zip(*base.footprint, strict=True)
    return Factsheet(
        type_specification=TypeSpecification(
            series_name=model.name,
            series_description=model.maker,
            mobile_robot_kinematics="OMNI" if base.holonomic else "DIFF",
            mobile_robot_class="CARRIER",
            maximum_load_mass=model.payload,
            localization_types=("NATURAL",),
            navigation_types=(navigation,),
        ),
        physical_parameters=PhysicalParameters(
            minimum_speed=0.0,
            maximum_speed=base.max_speed,
            maximum_angular_speed=base.max_yaw_rate,
            maximum_acceleration=base.acceleration,
            maximum_deceleration=base.acceleration,
            minimum_height=base.height,
            maximum_height=base.height,
            width=max(ys) - min(ys),
            length=max(xs) - min(xs),
        ),
        protocol_features=ProtocolFeatures((*instant, *tools.offered)),
        load_specification=LoadSpecification(
            load_sets=(
                LoadSet(
                    set_name="default",
                    load_type="EPAL",
                    maximum_weight=model.payload,
                    pick_time=arm.pick_duration if arm is not None else None,
                    drop_time=arm.place_duration if arm is not None else None,
                ),
            ),
        ),
    )
