# SPDX-License-Identifier: BSD-3-Clause
"""Writes the part of a fleet's launch file that has members speak over Zenoh."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from fleet_manager.config.launch_lines import yaml_line
from fleet_manager.config.zenoh_site import BLACKBOARD, FIRST_PORT

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from fleet_manager.config.fleet_file import Fleet
    from fleet_manager.config.zenoh_site import ZenohRouter

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
    routers = [router.name for router in fleet.zenoh.routers]
    known = [BLACKBOARD, *robots, *fleet.zenoh.operators, *routers]
    if unknown := [name for name in machine if name not in known]:
        return f"{', '.join(unknown)}; allowed: {', '.join(known)}"
    on_ros = [robot.name for robot in fleet.robots if not robot.is_agv]
    if len(here := [name for name in machine if name in on_ros]) > 1:
        return (
            f"{', '.join(here)}; allowed: one robot, because each has a ROS master of its own; "
            "besides it any number of AGVs with driver: vda5050"
        )
    if not (fleet.zenoh.members or routers):
        return (
            "the fleet file does not say where members are reached; write `zenoh: members:` or "
            "`routers:`"
        )
    return ""


def zenoh_lines(fleet: Fleet, machine: Collection[str]) -> Iterator[str]:
    """Yield the lines for those who run on this machine; all if it names nobody."""
    for router in fleet.zenoh.routers:
        if not machine or router.name in machine:
            yield _router_line(fleet, router)
    more = {"own_master": bool(machine)}
    for name in (BLACKBOARD, *(robot.name for robot in fleet.robots)):
        if not machine or name in machine:
            node = name if name == BLACKBOARD else f"{name}/robot"
            yield yaml_line(f"{node}/zenoh", connection_of(fleet, name) | more)
    operators = fleet.zenoh.operators if machine else fleet.zenoh.operators[:1]
    for name in operators:
        if not machine or name in machine:
            yield f'  <node pkg="fleet_manager" type="{GATEWAY}" name="{GATEWAY}" output="screen">'
            yield "  " + yaml_line("zenoh", connection_of(fleet, name) | more)
            yield "  </node>"


def connection_of(fleet: Fleet, name: str) -> dict[str, object]:
    """Return how a member, an operator or a router connects, as the parameter `zenoh` says it."""
    site = fleet.zenoh
    own = {"certificates": str(Path(site.certificates) / name)} if site.certificates else {}
    for place, router in enumerate(site.routers):
        if router.name == name:
            # Of two routers, the later one connects to the other.
            before = [each.address for each in site.routers[:place]]
            return _ends(fleet, [router.listen or router.address], before) | own
    if site.routers:
        routers = [router.address for router in site.routers_of(name)]
        return {"mode": "client"} | _ends(fleet, [], routers) | own
    addresses = addresses_of(fleet)
    if name not in addresses:
        return _ends(fleet, [], list(addresses.values())) | own
    # Of two members, the later one connects to the other.
    before = list(addresses.values())[: list(addresses).index(name)]
    return _ends(fleet, [addresses[name]], before) | own


def _ends(fleet: Fleet, listen: Sequence[str], connect: Sequence[str]) -> dict[str, object]:
    """Return where someone is reached and what it connects to, as Zenoh writes it."""
    protocol = "tls" if fleet.zenoh.certificates else "tcp"
    ends = {"listen": listen, "connect": connect}
    return {key: [f"{protocol}/{each}" for each in value] for key, value in ends.items() if value}


def _router_line(fleet: Fleet, router: ZenohRouter) -> str:
    """Return the line that runs a router, and again if it ends; it is no ROS node."""
    words = quoteattr(shlex.join(["router", router.name, "--fleet", str(fleet.path)]))
    return (
        f'  <node pkg="fleet_manager" type="hive" name="router_{router.name}" args={words} '
        'output="screen" respawn="true" respawn_delay="1"/>'
    )


def addresses_of(fleet: Fleet) -> dict[str, str]:
    """Return where each member is reached, in the order in which they connect."""
    if fleet.zenoh.members:
        return {member.name: member.address for member in fleet.zenoh.members}
    names = [BLACKBOARD, *(robot.name for robot in fleet.robots)]
    return {name: f"127.0.0.1:{FIRST_PORT + number}" for number, name in enumerate(names)}
