# SPDX-License-Identifier: BSD-3-Clause
"""Writes the launch file of a fleet, because roslaunch cannot loop over a list of robots."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

import attrs

from blackboard.costing.cost import measure_for

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fleet_manager.config.fleet_file import Fleet


def launch_text(fleet: Fleet, *, sim: bool) -> str:
    """Return the launch file that starts a fleet's blackboard and robots.

    It sets the parameters that robots need which join later, includes `blackboard.launch`, then
    `robot.launch` for each robot, in the fleet's order. With `sim`, robots are simulated.
    """
    lines = ["<launch>"]
    for name, value in {"cost_model": fleet.cost_model, "distance": fleet.distance}.items():
        lines.append(f'  <param name="/fleet/{name}" type="str" value="{value}"/>')
    lines += _charging(fleet)
    blackboard = {
        "decision": fleet.decision,
        "improve_by": measure_for(fleet.cost_model),
        "distance": fleet.distance,
        "bid_timeout": f"{fleet.bid_timeout:g}",
    }
    lines += _include("$(find blackboard)/launch/blackboard.launch", blackboard)
    for number, robot in enumerate(fleet.robots):
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
            "stands_by": str(number < fleet.stand_by).lower(),
        }
        if fleet.localization is not None:
            values["localization"] = fleet.localization
        lines += _include("$(find fleet_manager)/launch/robot.launch", values)
    lines.append("</launch>\n")
    return "\n".join(lines)


def _charging(fleet: Fleet) -> list[str]:
    """Return the lines that tell every robot of the hive when and where to charge."""
    levels = attrs.asdict(fleet.battery).items()
    lines = [f'  <param name="/charging/{name}" value="{level:g}"/>' for name, level in levels]
    places = json.dumps([{"name": c.name, "pose": c.pose} for c in fleet.chargers or ()])
    return [*lines, f'  <rosparam param="/charging/chargers">{escape(places)}</rosparam>']


def _include(file: str, values: Mapping[str, str]) -> list[str]:
    """Return the lines that include a launch file with values for its arguments."""
    lines = [f'  <include file="{file}">']
    lines += [f"    <arg name={quoteattr(k)} value={quoteattr(v)}/>" for k, v in values.items()]
    return [*lines, "  </include>"]
