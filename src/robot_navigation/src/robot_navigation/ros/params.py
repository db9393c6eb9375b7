# SPDX-License-Identifier: BSD-3-Clause
"""What nodes read before they start: their parameters, the robot's model, and the map."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any

import rospy
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg

from hive_common.errors import ParameterError
from hive_common.ros.params import number
from robot_description.model_schema import SCHEMA
from robot_description.models import RobotModel, model_from_dict
from robot_navigation.control.goal_tracker import NavigationSettings
from robot_navigation.localization.amcl_settings import AmclSettings
from robot_navigation.mapping.mapper_settings import MapperSettings

if TYPE_CHECKING:
    from collections.abc import Collection

AMCL_WITHOUT_EFFECT = frozenset({
    "base_frame_id", "do_beamskip", "beam_skip_distance", "beam_skip_error_threshold",
    "beam_skip_threshold", "first_map_only", "global_frame_id", "gui_publish_rate",
    "laser_lambda_short", "laser_max_range", "laser_min_range", "laser_model_type",
    "laser_z_max", "laser_z_short", "odom_frame_id", "save_pose_rate", "selective_resampling",
    "tf_broadcast", "use_map_topic", "bond_enabled",
})  # fmt: skip
"""Parameters of ROS's amcl that a file may hold and that are ignored."""

MAPPER_WITHOUT_EFFECT = frozenset({
    "astep", "base_frame", "iterations", "kernelSize", "lasamplerange", "lasamplestep",
    "llsamplerange", "llsamplestep", "lsigma", "lskip", "lstep", "map_frame", "maxRange",
    "minimumScore", "occ_thresh", "odom_frame", "ogain", "particles", "resampleThreshold",
    "sigma", "srr", "srt", "str", "stt", "temporalUpdate", "throttle_scans",
    "transform_publish_period",
})  # fmt: skip
"""Parameters of gmapping that a file may hold and that are ignored."""

MAP_TIMEOUT = 5.0
"""Time between two warnings that there is no map [s]."""


@dataclass(frozen=True)
class MoveBaseParams:
    """The parameters of the `move_base` node.

    Attributes:
        model: The robot.
        settings: See `NavigationSettings`.
        control_rate: Rounds of the control loop per second of ROS time [Hz].
        senses_timeout: Without a scan or a pose for this long the robot stops [s].
    """

    model: RobotModel
    settings: NavigationSettings
    control_rate: float
    senses_timeout: float


def hive_and_robot() -> tuple[str, str]:
    """Return the hive's namespace, which ends in a slash, and the robot's name below it.

    Raises:
        ParameterError: The node is not in a robot's namespace.
    """
    namespace = rospy.get_namespace()
    name = namespace.strip("/").rpartition("/")[2]
    if not name:
        raise ParameterError(
            "this node must run in its robot's namespace, for example robot1; "
            "start it with roslaunch robot_navigation navigation.launch name:=robot1"
        )
    return namespace[: -len(name) - 1], name


def read_model() -> RobotModel:
    """Read the robot's model from its parameter `characteristics`.

    Raises:
        ParameterError: The parameter is not there, or incomplete.
    """
    content = rospy.get_param("characteristics", {})
    missing = [key for key in SCHEMA["required"] if key not in content]
    if missing:
        raise ParameterError(
            f"{rospy.resolve_name('characteristics')} has no {', '.join(missing)}; "
            "load a robot model with roslaunch robot_description description.launch"
        )
    return model_from_dict(content)


def wait_for_map(topic: str) -> OccupancyGrid:
    """Return the map of a latched topic, its data as an array; warn while there is none.

    Raises:
        rospy.ROSInterruptException: The node was shut down.
    """
    while True:
        try:
            return rospy.wait_for_message(topic, numpy_msg(OccupancyGrid), timeout=MAP_TIMEOUT)
        except rospy.ROSInterruptException:
            raise
        except rospy.ROSException:
            rospy.logwarn(f"no map on {topic} yet; start a map server")


def read_move_base_params() -> MoveBaseParams:
    """Read the private parameters of `move_base`, and the robot's model.

    Raises:
        ParameterError: A parameter is unknown or has a value that is not allowed.
    """
    node = {"control_rate": 12.0, "senses_timeout": 1.0}
    settings = asdict(NavigationSettings())
    _private(node | settings)
    node = {name: _above_zero(name, default) for name, default in node.items()}
    # Every setting keeps the type of its default: attempts is a count, the others are measures.
    settings = {
        name: type(default)(_above_zero(name, default)) for name, default in settings.items()
    }
    return MoveBaseParams(read_model(), NavigationSettings(**settings), **node)


def read_amcl_settings(model: RobotModel) -> AmclSettings:
    """Read the private parameters of `amcl`; the model determines the default odometry model.

    Raises:
        ParameterError: A parameter is unknown or has a value that is not allowed.
    """
    kinds: dict[str, type] = {field.name: type(field.default) for field in fields(AmclSettings)}
    chosen: dict[str, Any] = {"odom_model_type": "omni" if model.base.holonomic else "diff"}
    for name, value in _private(kinds, AMCL_WITHOUT_EFFECT, "amcl.yaml").items():
        try:
            chosen[name] = kinds[name](value)
        except (TypeError, ValueError):
            allowed = {int: "a whole number", float: "a number"}.get(kinds[name], "a text")
            raise ParameterError(f"parameter ~{name}: {value!r}; allowed: {allowed}") from None
    chosen["odom_model_type"] = str(chosen["odom_model_type"]).removesuffix("-corrected")
    return AmclSettings(**chosen)


def read_mapper_settings() -> MapperSettings:
    """Read the private parameters of the mapper.

    Raises:
        ParameterError: A parameter is unknown or has a value that is not allowed.
    """
    names = [field.name for field in fields(MapperSettings)]
    given = _private(names, MAPPER_WITHOUT_EFFECT, "mapper.yaml")
    return MapperSettings(**{name: number(name, least=-1e6, most=1e6) for name in given})


def _private(
    known: Collection[str], without_effect: Collection[str] = (), config: str = ""
) -> dict[str, Any]:
    """Return the private parameters of this node, without those that have no effect."""
    given = {}
    for name, value in rospy.get_param(rospy.get_name(), {}).items():
        if name in without_effect:
            rospy.logwarn(f"parameter ~{name} has no effect here; see config/{config}")
        elif name in known:
            given[name] = value
        else:
            allowed = ", ".join(sorted(known))
            raise ParameterError(f"parameter ~{name} is unknown; allowed: {allowed}")
    return given


def _above_zero(name: str, default: float) -> float:
    value = rospy.get_param(f"~{name}", default)
    good = isinstance(value, int | float) and not isinstance(value, bool)
    if not (good and 0 < value < math.inf):
        raise ParameterError(f"parameter ~{name}: {value!r}; allowed: a number above 0")
    return float(value)
