# SPDX-License-Identifier: BSD-3-Clause
"""Writes the part of a fleet's launch file that has members speak over Zenoh."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fleet_manager.config.fleet_file import BLACKBOARD, FIRST_PORT
from fleet_manager.config.launch_lines import yaml_line

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from fleet_manager.config.fleet_file import Fleet

GATEWAY = "hive_gateway"
"""The node that shows the hive on this machine's ROS master."""


def unknown_on(fleet: Fleet, machine: Collection[str]) -> str:
    """Return why a fleet cannot have these members and operators on a machine of their own.

    The text says what is allowed; it is empty if the fleet can.
    """
    if not machine:
        return ""
    if fleet.transport == "ros":
        return (
            "with transport: ros all machines share one ROS master, which starts all; allowed: "
            "no machine, or `transport: zenoh` in the fleet file"
        )
    robots = [robot.name for robot in fleet.robots]
    known = [BLACKBOARD, *robots, *fleet.zenoh.operators]
    if unknown := [name for name in machine if name not in known]:
        return f"{', '.join(unknown)}; allowed: {', '.join(known)}"
    if len(here := [name for name in machine if name in robots]) > 1:
        return f"{', '.join(here)}; allowed: one robot, because each has a ROS master of its own"
    if not fleet.zenoh.members:
        return "the fleet file does not say where members are reached; write `zenoh: members:`"
    return ""


def zenoh_lines(fleet: Fleet, machine: Collection[str]) -> Iterator[str]:
    """Yield the lines for those who run on this machine; all if it names nobody."""
    addresses = addresses_of(fleet)
    protocol = "tls" if fleet.zenoh.certificates else "tcp"
    ends = [f"{protocol}/{address}" for address in addresses.values()]
    for place, name in enumerate(addresses):
        if not machine or name in machine:
            # Of two members, the later one connects to the other.
            own = {"listen": [ends[place]], "connect": ends[:place], "own_master": bool(machine)}
            node = name if name == BLACKBOARD else f"{name}/robot"
            yield yaml_line(f"{node}/zenoh", own | _certificates(fleet, name))
    operators = fleet.zenoh.operators if machine else fleet.zenoh.operators[:1]
    for name in operators:
        if not machine or name in machine:
            yield f'  <node pkg="fleet_manager" type="{GATEWAY}" name="{GATEWAY}" output="screen">'
            own = {"connect": ends, "own_master": bool(machine)}
            yield "  " + yaml_line("zenoh", own | _certificates(fleet, name))
            yield "  </node>"


def addresses_of(fleet: Fleet) -> dict[str, str]:
    """Return where each member is reached, in the order in which they connect."""
    if fleet.zenoh.members:
        return {member.name: member.address for member in fleet.zenoh.members}
    names = [BLACKBOARD, *(robot.name for robot in fleet.robots)]
    return {name: f"127.0.0.1:{FIRST_PORT + number}" for number, name in enumerate(names)}


def _certificates(fleet: Fleet, name: str) -> dict[str, str]:
    folder = fleet.zenoh.certificates
    return {"certificates": str(Path(folder) / name)} if folder else {}
