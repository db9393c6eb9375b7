# SPDX-License-Identifier: BSD-3-Clause
"""Opens RViz with the whole map in view, and a group of displays for every robot of the hive.

ROS Subscribers:
    map_metadata (nav_msgs/MapMetaData): the size of the map.
ROS Parameters:
    ~config: path of the RViz configuration; rviz.launch gives hive.rviz.
    ~timeout (30): how long to wait for the map and for the fleet, on the wall clock [s].
    ~fleet (false): whether a launch of a fleet is going on; it is over when there are `places`.
    ROBOT/robot_description of every robot that is shown; ROBOT/plan_topic (move_base/plan).
"""

from __future__ import annotations

import copy
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import rospkg
import rospy
import yaml
from nav_msgs.msg import MapMetaData

from hive_common.errors import HiveError, MapError
from hive_common.palette import robot_color
from hive_common.pose import Pose
from hive_common.ros.conversions import pose_from_msg
from hive_common.ros.names import RobotNames, plan_topic
from hive_common.ros.params import number, text
from hive_common.ros.reconnecting import keep_connected
from hive_common.ros.signals import init_node
from hive_common.turned_map import bounds_around

if TYPE_CHECKING:
    from collections.abc import Mapping

MOST_SHOWN = 20
"""Robots whose bodies and lasers RViz shows without being asked; it draws each at every step."""

_DESCRIPTION = "/robot_description"
_LOOK = 0.2  # time between two looks for the fleet [s]

AROUND = (60, 140)
"""Width and height that menu, tools, status and docks take of the window [pixels]."""


def main() -> int:
    """Fit the view, then become RViz; return an exit code if that is impossible."""
    init_node("rviz")
    keep_connected()
    try:
        path = _write_config()
    except (HiveError, rospy.ROSInterruptException) as error:
        rospy.logfatal(str(error))
        return 1
    except OSError as error:
        rospy.logfatal(f"{error.filename}: {error.strerror}; check the parameter ~config")
        return 1
    if rospy.is_shutdown():
        return 1
    rospy.signal_shutdown("RViz takes over")
    command = ["rviz", "-d", str(path), *sys.argv[1:]]
    return os.execvp(command[0], command)  # noqa: S606  (no shell is wanted)


def _write_config() -> Path:
    """Write the fitted configuration to ROS's own folder and return its path."""
    timeout = number("timeout", least=0.1, most=3600.0, default=30.0)
    config = Path(text("config")).read_text(encoding="utf-8")
    config = with_robots(config, _robots(timeout))
    path = Path(rospkg.get_ros_home()) / "hive.rviz"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(_fit(config, timeout), encoding="utf-8")
    return path


def _fit(config: str, timeout: float) -> str:
    """Return the configuration fitted to the map, or as it is if no map comes in time."""
    try:
        info = rospy.wait_for_message("map_metadata", MapMetaData, timeout=timeout)
    except rospy.ROSInterruptException:
        raise
    except rospy.ROSException:
        rospy.logwarn(f"no map on map_metadata within {timeout:g} s; the view stays as it is")
        return config
    size = (info.width * info.resolution, info.height * info.resolution)
    try:
        origin = pose_from_msg(info.origin)
    except ValueError as error:
        rospy.logwarn(f"the map's origin: {error}; the view stays as it is")
        return config
    left, low, right, high = bounds_around(origin, size)
    return fitted(config, Pose(left, low), (right - left, high - low))


def _robots(timeout: float) -> dict[str, str]:
    """Return the robots of the hive, each with the topic of its path in its namespace."""
    end = time.monotonic() + timeout
    is_launching = rospy.get_param("~fleet", False)
    while is_launching and not rospy.has_param("places") and time.monotonic() < end:
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException
        time.sleep(_LOOK)
    space = rospy.get_namespace()
    names = [
        name.removeprefix(space) for name in rospy.get_param_names() if name.startswith(space)
    ]
    robots = sorted(
        name.removesuffix(_DESCRIPTION) for name in names if name.endswith(_DESCRIPTION)
    )
    return {name: plan_topic(RobotNames(space, name)) for name in robots}


def with_robots(config: str, robots: Mapping[str, str]) -> str:
    """Return an RViz configuration with a group of displays for each robot, in its colour.

    The first group of the configuration is the pattern. Of more than `MOST_SHOWN` robots the
    groups are there and switched off: RViz would be too slow.

    Args:
        config: A configuration, as RViz writes it.
        robots: The topic of each robot's path, in its namespace unless it begins with a slash, by
            the robot's name; where there is none, the configuration stays as it is.

    Raises:
        MapError: The configuration has no list of displays.
    """
    content = yaml.safe_load(config)
    try:
        displays = content["Visualization Manager"]["Displays"]
        at = next((n for n, each in enumerate(displays) if each["Class"] == "rviz/Group"), None)
        if at is None or not robots:
            return config
        is_enabled = len(robots) <= MOST_SHOWN
        displays[at : at + 1] = [
            {**_group(displays[at], name, path), "Enabled": is_enabled}
            for name, path in robots.items()
        ]
    except (KeyError, TypeError, AttributeError):
        raise MapError("the RViz configuration has no list of displays; take hive.rviz") from None
    return str(yaml.safe_dump(content, sort_keys=False))


def _group(pattern: dict[str, Any], robot: str, path: str) -> dict[str, Any]:
    """Return the displays of a robot, made from those of another; `path` is its path's topic."""
    group = copy.deepcopy(pattern)
    group["Name"] = robot
    shade = "; ".join(str(round(255 * part)) for part in robot_color(robot)[:3])
    for display in group["Displays"]:
        for key, value in display.items():
            if isinstance(value, str) and value.startswith(f"{pattern['Name']}/"):
                display[key] = robot + value.removeprefix(pattern["Name"])
        if "Color" in display:
            display["Color"] = shade
        if display["Class"] == "rviz/Path":
            display["Topic"] = path if path.startswith("/") else f"{robot}/{path}"
    return group


def fitted(config: str, origin: Pose, size: tuple[float, float]) -> str:
    """Return an RViz configuration that shows the whole of a map.

    Args:
        config: A configuration with a TopDownOrtho view, as RViz writes it.
        origin: Lower left corner of the map, frame map [m, m, rad].
        size: Width and height of the map [m].

    Raises:
        MapError: The configuration has no such view, or the map no size.
    """
    if min(size) <= 0:
        raise MapError(f"the map is {size[0]:g} m x {size[1]:g} m; it must have a size")
    content = yaml.safe_load(config)
    try:
        window = content["Window Geometry"]["Width"], content["Window Geometry"]["Height"]
        view = content["Visualization Manager"]["Views"]["Current"]
    except (KeyError, TypeError):
        raise MapError("the RViz configuration has no window or view; take hive.rviz") from None
    view["Scale"] = min((window[axis] - AROUND[axis]) / size[axis] for axis in (0, 1))
    view["X"] = origin.x + size[0] / 2
    view["Y"] = origin.y + size[1] / 2
    return str(yaml.safe_dump(content, sort_keys=False))
