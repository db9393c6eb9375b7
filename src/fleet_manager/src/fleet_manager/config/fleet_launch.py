# SPDX-License-Identifier: BSD-3-Clause
"""Writes the launch file of a fleet, because roslaunch cannot loop over a list of robots."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import attrs

from blackboard.costing.cost import measure_for
from fleet_manager.config.fleet_file import plan_topic
from fleet_manager.config.launch_lines import yaml_line
from fleet_manager.config.zenoh_launch import zenoh_lines
from fleet_manager.config.zenoh_site import BLACKBOARD
from robot_description.models import model_path
from robot_description.urdf import robot_urdf
from vda5050.mqtt.link import BrokerSettings
from vda5050.mqtt.local_broker import free_port

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from fleet_manager.config.fleet_file import Fleet, FleetRobot
    from hive_common.landmark import Landmark
    from hive_common.pose import Pose
    from hive_common.zone import Zone


MOST_HOSTED = 10
"""Robots in one process: in Python, one process uses at most one core (docs/decisions/092)."""


def launch_text(
    fleet: Fleet,
    *,
    sim: bool,
    landmarks: Sequence[Landmark] = (),
    places: Mapping[str, Pose] = MappingProxyType({}),
    port: Callable[[], int] = free_port,
    machine: Collection[str] = (),
    chart: str | None = None,
) -> str:
    """Return the launch file that starts a fleet's blackboard and robots.

    It sets the parameters that robots need which join later, includes `blackboard.launch`, then
    `robot.launch` for each robot, in the fleet's order. With `sim`, robots are simulated; unless
    the fleet says otherwise, `robot_host` nodes then take the place of `robot.launch`.
    `landmarks` are what the building's places are called, and `places` those that an operator can
    name as a goal, each with the pose of a robot there [map frame]. `port` gives one for a broker
    of the fleet's own, which AGVs that speak VDA 5050 need where the fleet names none. `machine`
    names who runs on this machine, members and operators; if it names nobody, all do. `chart` is
    the map, a name in maps/ or a path, for a map server; a robot with stock names has its own.
    """
    lines = ["<launch>"]
    for name, value in {"cost_model": fleet.cost_model, "distance": fleet.distance}.items():
        lines.append(f'  <param name="fleet/{name}" type="str" value="{value}"/>')
    lines += _charging(fleet)
    lines.append(yaml_line("traffic_planner/zones", [_zone(zone) for zone in fleet.zones]))
    lines.append(yaml_line("traffic_planner/places", [attrs.asdict(each) for each in landmarks]))
    named = [{"name": name, "pose": list(pose)} for name, pose in places.items()]
    lines.append(yaml_line("places", named))
    blackboard = {
        "decision": fleet.decision,
        "improve_by": measure_for(fleet.cost_model),
        "distance": fleet.distance,
        "bid_timeout": f"{fleet.bid_timeout:g}",
        "traffic": fleet.traffic,
    }
    if chart is not None and (sim or not stock_robots(fleet, machine)):
        lines += _map_server(chart)
    if not machine or BLACKBOARD in machine:
        lines += _include("$(find blackboard)/launch/blackboard.launch", blackboard)
    else:
        lines += blackboard_parameters(blackboard | {"bid_timeout": fleet.bid_timeout})
    if sim and not machine and _shares(fleet):
        lines += _shared(fleet)
    else:
        for number, robot in enumerate(fleet.robots):
            if not robot.is_agv and (not machine or robot.name in machine):
                lines += _each(fleet, robot, sim=sim, stands_by=number < fleet.stand_by)
    if fleet.transport == "zenoh":
        lines += zenoh_lines(fleet, machine)
        lines += _shown_elsewhere(fleet, machine)
    lines += agv_lines(fleet, port, machine)
    lines.append("</launch>\n")
    return "\n".join(lines)


def _shares(fleet: Fleet) -> bool:
    """Return whether simulated robots share processes."""
    if fleet.processes is None:
        return fleet.transport == "ros"
    return fleet.processes == "shared"


def _map_server(chart: str) -> list[str]:
    served = {"map": chart, "respawn": "true"}
    return _include("$(find simenv)/launch/map_server.launch", served)


def _shown_elsewhere(fleet: Fleet, machine: Collection[str]) -> list[str]:
    """Return the lines by which an operator's machine shows robots of other machines."""
    if set(fleet.zenoh.operators).isdisjoint(machine):
        return []
    others = [robot for robot in fleet.robots if robot.name not in machine]
    return [_description(robot) for robot in others if robot.model]


def stock_robots(fleet: Fleet, machine: Collection[str]) -> list[str]:
    """Return which real robots on a machine have the names of ROS's stack; see `launch_text`."""
    return [
        robot.name
        for robot in fleet.robots
        if robot.has_stock_names and (not machine or robot.name in machine)
    ]


def blackboard_parameters(values: Mapping[str, object]) -> list[str]:
    """Return the lines that set the hive's settings on a machine without the blackboard node."""
    file = "$(find blackboard)/config/blackboard.yaml"
    load = f'  <rosparam command="load" file="{file}" ns="blackboard"/>'
    return [load, yaml_line("blackboard", values)]


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
    given = {
        "localization": robot.localization,
        "navigation": robot.navigation,
        "plan": robot.plan,
    }
    if robot.has_stock_names and not sim:
        plan = None if robot.plan is None else f"/{robot.plan}"
        given = {"names": "stock", "plan": plan}
    values |= {name: value for name, value in given.items() if value is not None}
    return _include("$(find fleet_manager)/launch/robot.launch", values)


def _shared(fleet: Fleet) -> list[str]:
    """Return the lines of simulated robots that share processes.

    The parameters are those that the launch files of each robot set.
    """
    lines = []
    members = [each for each in fleet.robots if not each.is_agv]
    for number, robot in enumerate(fleet.robots):
        if robot.is_agv:
            continue
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
        }
        if robot.navigation != "none":
            files["move_base"] = "$(find hive_navigation)/config/move_base.yaml"
        if robot.localization == "amcl":
            files["amcl"] = "$(find hive_navigation)/config/amcl.yaml"
            start = {"initial_pose_x": x, "initial_pose_y": y, "initial_pose_a": yaw}
            settings["amcl"] = dict(start)
        lines += parameters(robot, files, settings)
        if (plan := plan_topic(robot)) is not None:
            lines.append(_text(f"{robot.name}/plan_topic", plan))
    for first in range(0, len(members), MOST_HOSTED):
        hosted = [
            {
                "name": each.name,
                "model": each.model,
                "pose": each.pose,
                "localization": each.localization or "fake_localization",
                "navigation": each.navigation or "ours",
            }
            for each in members[first : first + MOST_HOSTED]
        ]
        name = f"robot_host_{first // MOST_HOSTED + 1}"
        lines.append(
            f'  <node pkg="fleet_manager" type="robot_host" name="{name}" output="screen">'
        )
        lines += ["  " + yaml_line("robots", hosted), "  </node>"]
    return lines


def parameters(
    robot: FleetRobot, files: Mapping[str, str], settings: Mapping[str, object]
) -> list[str]:
    """Return the lines that load a robot's parameters: files and values, by their node."""
    lines = [
        f'  <rosparam command="load" file={quoteattr(file)} ns="{robot.name}/{node}"/>'
        for node, file in files.items()
    ]
    lines += [yaml_line(f"{robot.name}/{node}", values) for node, values in settings.items()]
    if robot.model:
        lines.append(_description(robot))
    return lines


def _description(robot: FleetRobot) -> str:
    """Return the line that loads a robot's URDF, by which RViz draws it."""
    return _text(f"{robot.name}/robot_description", robot_urdf(robot.model, f"{robot.name}/"))


def _text(name: str, value: str) -> str:
    """Return the line that sets a parameter to a text."""
    return f'  <param name={quoteattr(name)} type="str" value={quoteattr(value)}/>'


def _charging(fleet: Fleet) -> list[str]:
    """Return the lines that tell every robot of the hive when and where to charge."""
    levels = attrs.asdict(fleet.battery).items()
    lines = [f'  <param name="charging/{name}" value="{level:g}"/>' for name, level in levels]
    places = [{"name": c.name, "pose": c.pose} for c in fleet.chargers or ()]
    return [*lines, yaml_line("charging/chargers", places)]


def _zone(zone: Zone) -> dict[str, object]:
    """Return a zone as plain data, without what it does not say."""
    given = attrs.asdict(zone, recurse=False)
    return {key: value for key, value in given.items() if value is not None}


def _include(file: str, values: Mapping[str, str]) -> list[str]:
    """Return the lines that include a launch file with values for its arguments."""
    lines = [f'  <include file="{file}">']
    lines += [f"    <arg name={quoteattr(k)} value={quoteattr(v)}/>" for k, v in values.items()]
    return [*lines, "  </include>"]


def agv_lines(fleet: Fleet, port: Callable[[], int], machine: Collection[str] = ()) -> list[str]:
    """Return the lines of the AGVs that speak VDA 5050: their agent, and those simulated.

    See `launch_text` for the arguments.
    """
    agvs = [
        (number, each)
        for number, each in enumerate(fleet.robots)
        if each.is_agv and (not machine or each.name in machine)
    ]
    if not agvs:
        return []
    lines = []
    broker = fleet.broker
    if broker is None:
        broker = BrokerSettings(port=port())
        lines.append(
            f'  <node pkg="vda5050" type="broker" name="broker" args="{broker.port}" '
            'respawn="true" respawn_delay="1"/>'
        )
    for number, robot in agvs:
        files = {"robot": "$(find blackboard)/config/robot.yaml"}
        if robot.model:
            files["characteristics"] = str(model_path(robot.model))
        own = {
            "cost_model": fleet.cost_model,
            "distance": fleet.distance,
            "stands_by": number < fleet.stand_by,
        }
        lines += parameters(robot, files, {"robot": own})
    simulated = [robot for _, robot in agvs if robot.simulated]
    entries = [_entry(robot) | {"pose": robot.pose} for robot in simulated]
    told = {key: value for key, value in attrs.asdict(broker).items() if value is not None}
    if entries:
        lines += _node("simulated_agv", {"agvs": entries, "broker": told})
    known = [
        _entry(robot) | {"maker": robot.vda5050.maker, "simulated": robot.simulated}
        for _, robot in agvs
    ]
    return [*lines, *_node("vda5050_agent", {"robots": known, "broker": told}, ' respawn="true"')]


def _entry(robot: FleetRobot) -> dict[str, object]:
    """Return what both ends are told about an AGV."""
    agv = robot.vda5050
    entry: dict[str, object] = {
        "name": robot.name,
        "manufacturer": agv.manufacturer,
        "serial": agv.serial or robot.name,
        "version": agv.version,
    }
    given = {"model": robot.model or None, "interface": agv.interface}
    return entry | {key: value for key, value in given.items() if value is not None}


def _node(kind: str, values: Mapping[str, object], more: str = "") -> list[str]:
    """Return the lines of a node of vda5050 with parameters, and more attributes if need be."""
    head = f'  <node pkg="vda5050" type="{kind}" name="{kind}" output="screen"{more}>'
    inner = [f"  {yaml_line(name, value)}" for name, value in values.items()]
    return [head, *inner, "  </node>"]
