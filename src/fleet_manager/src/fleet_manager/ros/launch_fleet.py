# SPDX-License-Identifier: BSD-3-Clause
"""Checks a fleet file and replaces itself by a roslaunch that starts blackboard and robots."""

from __future__ import annotations

import sys

import click
from attrs import evolve

from blackboard.domain.charger import Charger
from blackboard.domain.settings import TRAFFIC
from fleet_manager.config.fleet_file import (
    PROCESSES,
    check_zones_on_map,
    read_fleet,
)
from fleet_manager.config.fleet_launch import launch_text
from fleet_manager.config.places import landmarks_of
from fleet_manager.ros.launch_checked import become_roslaunch
from hive_common.errors import HiveError
from hive_common.map_file import load_map
from simenv.world.world_file import load_world

_BAD_INPUT = 2


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("fleet")
@click.option("--sim", type=bool, default=True, show_default=True, help="Robots are simulated.")
@click.option("--check", is_flag=True, help="Only check the files and print the launch file.")
@click.option("--world", help="Where chargers and stations are: name in worlds/ or a path.")
@click.option(
    "--processes",
    type=click.Choice(["", *PROCESSES]),
    default="",
    help="In place of the fleet's: each node a process, or simulated robots share a few.",
)
@click.option(
    "--traffic",
    type=click.Choice(["", *TRAFFIC]),
    default="",
    help="In place of the fleet's: robots give way to each other, or a traffic planner plans.",
)
@click.option("--map", "chart", help="A map to check as well: name in maps/ or a path.")
def launch_fleet(
    fleet: str,
    sim: bool,
    check: bool,
    world: str | None,
    processes: str,
    traffic: str,
    chart: str | None,
) -> None:
    """Start the blackboard and every robot of FLEET, a name in fleets/ or a path.

    A mistake in a file is printed in one line, and the exit code is 2, before anything starts.
    """
    try:
        wanted = read_fleet(fleet)
        wanted = evolve(
            wanted,
            processes=processes or wanted.processes,
            traffic=traffic or wanted.traffic,
        )
        building = load_world(world) if world is not None and sim else None
        if building is not None:
            there = tuple(Charger(name=p.name, pose=p.pose) for p in building.chargers)
            wanted = evolve(wanted, chargers=wanted.chargers or there)
        landmarks = landmarks_of(building, wanted.chargers or ())
        text = launch_text(wanted, sim=sim, landmarks=landmarks)
        if chart is not None:
            check_zones_on_map(wanted, load_map(chart).bounds)
    except HiveError as error:
        click.echo(f"launch_fleet: {error}", err=True)
        sys.exit(_BAD_INPUT)
    if wanted.zones and wanted.traffic == "local":
        remedy = "start with traffic:=planned, or write `traffic: planned` in the fleet file"
        click.echo(f"launch_fleet: the fleet's zones bind nobody: {remedy}", err=True)
    if check:
        click.echo(text, nl=False)
    else:
        become_roslaunch(text)


def main() -> None:
    """Run with this process's arguments; those that ROS adds are left out."""
    launch_fleet([word for word in sys.argv[1:] if ":=" not in word])
