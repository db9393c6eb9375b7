# SPDX-License-Identifier: BSD-3-Clause
"""Reads the parameters of `move_base`, once, into values that are checked."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any

import rospy

from hive_common.errors import ParameterError
from hive_common.ros.params import number
from hive_common.structuring import NotAllowedError, structure
from robot_description.models import RobotModel
from robot_navigation.control.settings import Settings
from robot_navigation.localization.amcl_settings import AmclSettings
from robot_navigation.mapping.mapper_settings import WITHOUT_EFFECT as MAPPER_WITHOUT_EFFECT
from robot_navigation.mapping.mapper_settings import MapperSettings

AMCL_WITHOUT_EFFECT = frozenset({
    "base_frame_id", "do_beamskip", "beam_skip_distance", "beam_skip_error_threshold",
    "beam_skip_threshold", "first_map_only", "global_frame_id", "gui_publish_rate",
    "laser_lambda_short", "laser_max_range", "laser_min_range", "laser_model_type",
    "laser_z_max", "laser_z_short", "odom_frame_id", "save_pose_rate", "selective_resampling",
    "tf_broadcast", "use_map_topic", "bond_enabled",
})  # fmt: skip
"""Parameters of ROS's amcl that a file may hold, and that change nothing here."""


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
    return MoveBaseParams(read_model(), Settings(**chosen), **own)


def read_amcl_settings(model: RobotModel) -> AmclSettings:
    """Read the private parameters of `amcl`.

    Args:
        model: What the robot is; says which odometry model is meant where no parameter does.

    Raises:
        ParameterError: One is unknown.
        SettingError: One is not what it must be.
    """
    kinds = {field.name: type(field.default) for field in fields(AmclSettings)}
    chosen: dict[str, Any] = {"odom_model_type": "omni" if model.base.holonomic else "diff"}
    for name, value in rospy.get_param(rospy.get_name(), {}).items():
        if name in AMCL_WITHOUT_EFFECT:
            rospy.logwarn(f"{rospy.get_name()}/{name} has no effect here; see config/amcl.yaml")
        elif name not in kinds:
            allowed = ", ".join(sorted(kinds))
            raise ParameterError(f"{rospy.get_name()}/{name} is unknown; allowed: {allowed}")
        else:
            chosen[name] = _converted(name, value, kinds[name])
    chosen["odom_model_type"] = str(chosen["odom_model_type"]).removesuffix("-corrected")
    return AmclSettings(**chosen)


def _converted(name: str, value: object, kind: type) -> object:
    """Return a parameter as the kind of value that is needed: whole numbers, numbers, words."""
    try:
        return kind(value)
    except (TypeError, ValueError):
        full_name = rospy.resolve_name(f"~{name}")
        words = {int: "a whole number", float: "a number"}.get(kind, "a word")
        raise ParameterError(f"{full_name} is {value!r}; allowed: {words}") from None


def _above_zero(name: str, default: float) -> float:
    value = rospy.get_param(f"~{name}", default)
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not (good and 0 < value < math.inf):
        full_name = rospy.resolve_name(f"~{name}")
        raise ParameterError(f"{full_name} is {value!r}; allowed: a number above 0")
    return float(value)


def read_model() -> RobotModel:
    """Read what the robot is from its parameter `characteristics`.

    Raises:
        ParameterError: It is missing, or holds something that is not allowed.
    """
    try:
        return structure(rospy.get_param("characteristics", {}), RobotModel)
    except NotAllowedError as error:
        raise ParameterError(
            f"{rospy.resolve_name('characteristics')}: {error}; "
            "load a robot model with roslaunch robot_description description.launch"
        ) from None


def mapper_settings() -> MapperSettings:
    """Read the mapper's parameters, which have the names that gmapping has for them.

    Raises:
        ParameterError: One is unknown, or not what it must be.
    """
    names = {field.name for field in fields(MapperSettings)}
    chosen: dict[str, float] = {}
    for name in rospy.get_param(rospy.get_name(), {}):
        if name in MAPPER_WITHOUT_EFFECT:
            rospy.logwarn(f"{rospy.get_name()}/{name} has no effect here; see config/mapper.yaml")
        elif name not in names:
            raise ParameterError(
                f"parameter ~{name} is unknown; allowed: {', '.join(sorted(names))}"
            )
        else:
            chosen[name] = number(name, least=-1e6, most=1e6)
    return MapperSettings(**chosen)
