# SPDX-License-Identifier: BSD-3-Clause
"""Reads the parameters of `move_base`, once, into values that are checked."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import rospy

from robot_description.errors import RobotDescriptionError
from robot_description.model_schema import SCHEMA
from robot_description.models import RobotModel, model_from_dict
from robot_description.navigator import Settings


class ParameterError(RobotDescriptionError):
    """A parameter is missing or has a value that is not allowed; the text names it and what is."""


@dataclass(frozen=True)
class MoveBaseParams:
    """What the `move_base` node is told.

    Attributes:
        model: What the robot is.
        settings: How it behaves towards what is in its way.
        control_rate: Rounds of the control loop per second of ROS time [Hz].
        senses_timeout: Without a scan or a pose for this long it stands still [s].
    """

    model: RobotModel
    settings: Settings
    control_rate: float
    senses_timeout: float


def hive_and_robot() -> tuple[str, str]:
    """Return the hive's namespace, ending in a slash, and the robot's name below it.

    Raises:
        ParameterError: The node does not run in a robot's namespace.
    """
    namespace = rospy.get_namespace()
    name = namespace.strip("/").rpartition("/")[2]
    if not name:
        raise ParameterError(
            "this node has to run in its robot's namespace, for example robot1; "
            "start it with roslaunch robot_description navigation.launch name:=robot1"
        )
    return namespace[: -len(name) - 1], name


def read_move_base_params() -> MoveBaseParams:
    """Read the private parameters, and the robot's `characteristics`.

    Raises:
        ParameterError: One is not what it must be.
    """
    own = {"control_rate": 12.0, "senses_timeout": 1.0}
    settings = asdict(Settings())
    for name in rospy.get_param(rospy.get_name(), {}):
        if name not in own | settings:
            allowed = ", ".join(sorted(own | settings))
            raise ParameterError(f"{rospy.get_name()}/{name} is unknown; allowed: {allowed}")
    own = {name: _above_zero(name, default) for name, default in own.items()}
    # Every setting keeps the type of its default: attempts are counted, the rest is measured.
    chosen = {
        name: type(default)(_above_zero(name, default)) for name, default in settings.items()
    }
    return MoveBaseParams(_model(), Settings(**chosen), **own)


def _above_zero(name: str, default: float) -> float:
    value = rospy.get_param(f"~{name}", default)
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not (good and 0 < value < math.inf):
        full_name = rospy.resolve_name(f"~{name}")
        raise ParameterError(f"{full_name} is {value!r}; allowed: a number above 0")
    return float(value)


def _model() -> RobotModel:
    content = rospy.get_param("characteristics", {})
    missing = [key for key in SCHEMA["required"] if key not in content]
    if missing:
        raise ParameterError(
            f"{rospy.resolve_name('characteristics')} has no {', '.join(missing)}; "
            "load a robot model with roslaunch robot_description description.launch"
        )
    return model_from_dict(content)
