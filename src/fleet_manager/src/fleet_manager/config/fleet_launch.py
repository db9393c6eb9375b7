# SPDX-License-Identifier: BSD-3-Clause
"""Writes the launch file of a fleet, because roslaunch cannot loop over a list of robots."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

import attrs

from blackboard.costing.cost import measure_for
from robot_description.models import model_path

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from fleet_manager.config.fleet_file import Fleet, FleetRobot
    from hive_common.landmark import Landmark
    from hive_common.zone import Zone


MOST_HOSTED = 10
"""Robots in one process: in Python, one process uses at most one core (docs/decisions/092)."""


def launch_text(fleet: Fleet, *, sim: bool, landmarks: Sequence[Landmark] = ()) -> str:
    """Return the launch file that starts a fleet's blackboard and robots.

    It sets the parameters that robots need which join later, includes `blackboard.launch`, then
    `robot.launch` for each robot, in the fleet's order. With `sim`, robots are simulated; unless
    the fleet says otherwise, `robot_host` nodes then take the place of `robot.launch`.
    `landmarks` are what the building's places are called.
    """
    lines = ["<launch>"]
    for name, value in {"cost_model": fleet.cost_model, "distance": fleet.distance}.items():
        lines.append(f'  <param name="/fleet/{name}" type="str" value="{value}"/>')
    lines += _charging(fleet)
    lines.append(_yaml("/traffic_planner/zones", [_zone(zone) for zone in fleet.zones]))
    lines.append(_yaml("/traffic_planner/places", [attrs.asdict(each) for each in landmarks]))
    blackboard = {
        "decision": fleet.decision,
        "improve_by": measure_for(fleet.cost_model),
        "distance": fleet.distance,
        "bid_timeout": f"{fleet.bid_timeout:g}",
        "traffic": fleet.traffic,
    }
    lines += _include("$(find blackboard)/launch/blackboard.launch", blackboard)
    if sim and fleet.processes != "each":
        lines += _shared(fleet)
    else:
        for number, robot in enumerate(fleet.robots):
            lines += _each(fleet, robot, sim=sim, stands_by=number < fleet.stand_by)
    lines.append("</launch>\n")
    return "\n".join(lines)


def _each(fleet: Fleet, robot: FleetRobot, *, sim: bool, stands_by: bool) -> list[str]:
    """Return the lines of a robot whose nodes have a process each."""
    x, y, yaw = robot.pose
    values = {
        "name": robot.name,
        "model": robot.model,
        "x": f"{x:g}",
        "y": f"{y:g}",
        "yaw": f"{yaw:g}",
        "sim": str(sim).lower(),
        "cost_model": fleet.cost_model,
        "distance": fleet.distance,
        "stands_by": str(stands_by).lower(),
    }
    if fleet.localization is not None:
        values["localization"] = fleet.localization
    return _include("$(find fleet_manager)/launch/robot.launch", values)


def _shared(fleet: Fleet) -> list[str]:
    """Return the lines of simulated robots that share processes.

    The parameters are those that the launch files of each robot set.
    """
    lines = []
    localization = fleet.localization or "fake_localization"
    for number, robot in enumerate(fleet.robots):
        x, y, yaw = robot.pose
        settings: dict[str, dict[str, object]] = {
            "robot": {
                "cost_model": fleet.cost_model,
                "distance": fleet.distance,
                "stands_by": number < fleet.stand_by,
            }
        }
        files = {
            "characteristics": str(model_path(robot.model)),
            "robot": "$(find blackboard)/config/robot.yaml",
            "move_base": "$(find robot_navigation)/config/move_base.yaml",
        }
        if localization == "amcl":
            files["amcl"] = "$(find robot_navigation)/config/amcl.yaml"
            start = {"initial_pose_x": x, "initial_pose_y": y, "initial_pose_a": yaw}
            settings["amcl"] = dict(start)
        lines += [
            f'  <rosparam command="load" file={quoteattr(file)} ns="{robot.name}/{node}"/>'
            for node, file in files.items()
        ]
        lines += [_yaml(f"{robot.name}/{node}", values) for node, values in settings.items()]
        lines.append(_text(f"{robot.name}/robot_description", _urdf(robot)))
    for first in range(0, len(fleet.robots), MOST_HOSTED):
        hosted = [
            {
                "name": each.name,
                "model": each.model,
                "pose": each.pose,
                "localization": localization,
            }
            for each in fleet.robots[first : first + MOST_HOSTED]
        ]
        name = f"robot_host_{first // MOST_HOSTED + 1}"
        lines.append(
            f'  <node pkg="fleet_manager" type="robot_host" name="{name}" output="screen">'
        )
        lines += ["  " + _yaml("robots", hosted), "  </node>"]
    return lines


def _urdf(robot: FleetRobot) -> str:
    # xacro takes long to import, and only this needs it.
    from robot_description.urdf import robot_urdf  # noqa: PLC0415

    return robot_urdf(robot.model, f"{robot.name}/")


def _yaml(name: str, value: object) -> str:
    """Return the line that sets a parameter, or those below it, to a value."""
    return f"  <rosparam param={quoteattr(name)}>{escape(json.dumps(value))}</rosparam>"


def _text(name: str, value: str) -> str:
    """Return the line that sets a parameter to a text."""
    return f'  <param name={quoteattr(name)} type="str" value={quoteattr(value)}/>'


def _charging(fleet: Fleet) -> list[str]:
    """Return the lines that tell every robot of the hive when and where to charge."""
    levels = attrs.asdict(fleet.battery).items()
    lines = [f'  <param name="/charging/{name}" value="{level:g}"/>' for name, level in levels]
    places = [{"name": c.name, "pose": c.pose} for c in fleet.chargers or ()]
    return [*lines, _yaml("/charging/chargers", places)]


def _zone(zone: Zone) -> dict[str, object]:
    """Return a zone as plain data, without what it does not say."""
    given = attrs.asdict(zone, recurse=False)
    return {key: value for key, value in given.items() if value is not None}


def _include(file: str, values: Mapping[str, str]) -> list[str]:
    """Return the lines that include a launch file with values for its arguments."""
    lines = [f'  <include file="{file}">']
    lines += [f"    <arg name={quoteattr(k)} value={quoteattr(v)}/>" for k, v in values.items()]
    return [*lines, "  </include>"]
