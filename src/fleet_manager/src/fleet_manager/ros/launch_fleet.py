# SPDX-License-Identifier: BSD-3-Clause
"""Checks a fleet file and replaces itself by a roslaunch that starts blackboard and robots."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click
from attrs import evolve

from blackboard.domain.charger import Charger
from blackboard.domain.settings import TRAFFIC
from fleet_manager.config.fleet_check import building_mistakes
from fleet_manager.config.fleet_file import (
    PROCESSES,
    TRANSPORTS,
    read_fleet_and_mistakes,
)
from fleet_manager.config.fleet_launch import launch_text, stock_robots
from fleet_manager.config.places import landmarks_of, places_of
from fleet_manager.config.zenoh_launch import unknown_on
from fleet_manager.errors import InputError
from fleet_manager.ros.launch_checked import become_roslaunch
from hive_common.errors import HiveError
from hive_common.map_file import load_map
from simenv.world.world_file import load_world, world_mistakes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from fleet_manager.config.fleet_file import Fleet
    from hive_common.grid_map import GridMap
    from simenv.world.world import World

_BAD_INPUT = 2


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("fleet")
@click.option("--sim", type=bool, default=True, show_default=True, help="Robots are simulated.")
@click.option("--check", is_flag=True, help="Only check the files; name every mistake.")
@click.option("--print", "shown", is_flag=True, help="Check the files, print the launch file.")
@click.option("--world", help="The building that is simulated: name in worlds/ or a path.")
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
@click.option(
    "--transport",
    type=click.Choice(["", *TRANSPORTS]),
    default="",
    help="In place of the fleet's: ROS topics of one master, or Zenoh between many.",
)
@click.option(
    "--machine",
    default="",
    help="Who runs here, separated by spaces; others run on machines of their own.",
)
@click.option("--map", "chart", help="The map that robots have: name in maps/ or a path.")
def launch_fleet(
    fleet: str,
    sim: bool,
    check: bool,
    shown: bool,
    world: str | None,
    processes: str,
    traffic: str,
    transport: str,
    machine: str,
    chart: str | None,
) -> None:
    """Start the blackboard and every robot of FLEET, a name in fleets/ or a path.

    Every mistake in the files is printed in a line of its own, and the exit code is 2, before
    anything starts.
    """
    here = machine.split()
    wanted, building, mistakes = _read(fleet, world if sim else None, chart)
    if wanted is not None:
        wanted = evolve(
            wanted,
            processes=processes or wanted.processes,
            traffic=traffic or wanted.traffic,
            transport=transport or wanted.transport,
        )
        mistakes = [*mistakes, *_machine_mistakes(wanted, here)]
        mistakes += [] if sim else _stock_mistakes(wanted, here)
    if wanted is None or mistakes:
        for mistake in mistakes:
            click.echo(f"launch_fleet: {mistake}", err=True)
        sys.exit(_BAD_INPUT)
    if building is not None:
        there = tuple(Charger(name=p.name, pose=p.pose) for p in building.chargers)
        wanted = evolve(wanted, chargers=wanted.chargers or there)
    if wanted.zones and wanted.traffic == "local":
        remedy = "start with traffic:=planned, or write `traffic: planned` in the fleet file"
        click.echo(f"launch_fleet: the fleet's zones bind nobody: {remedy}", err=True)
    if check:
        click.echo(f"{fleet}: good. {_summary(wanted)}")
        return
    landmarks = landmarks_of(building, wanted.chargers or ())
    places = dict(places_of(world)) if world is not None and sim else {}
    places |= {charger.name: charger.pose for charger in wanted.chargers or ()}
    text = launch_text(
        wanted, sim=sim, landmarks=landmarks, places=places, machine=here, chart=chart
    )
    if shown:
        click.echo(text, nl=False)
    else:
        become_roslaunch(text)


def _machine_mistakes(fleet: Fleet, machine: Sequence[str]) -> Iterator[HiveError]:
    """Yield what keeps a fleet from having these on this machine."""
    if why := unknown_on(fleet, machine):
        yield InputError(f"machine: {why}")


def _stock_mistakes(fleet: Fleet, machine: Sequence[str]) -> Iterator[HiveError]:
    """Yield that several robots on one ROS master have the same names."""
    here = stock_robots(fleet, machine)
    if len(here) > 1:
        yield InputError(
            f"names: {', '.join(here)} have stock names, such as /move_base; allowed: one robot "
            "on a ROS master. With transport: zenoh each has a master of its own, machine:="
            f"{here[0]} on its machine"
        )


def _read(
    fleet: str, world: str | None, chart: str | None
) -> tuple[Fleet | None, World | None, Sequence[HiveError]]:
    """Return the fleet and the world, and all mistakes in the files and of one against another."""
    mistakes: list[HiveError] = []
    wanted: Fleet | None = None
    building: World | None = None
    ground: GridMap | None = None
    with _noted(mistakes):
        wanted, found = read_fleet_and_mistakes(fleet)
        mistakes += found
    with _noted(mistakes):
        if world is not None:
            wrong = world_mistakes(world)
            mistakes += wrong
            building = None if wrong else load_world(world)
    with _noted(mistakes):
        ground = load_map(chart) if chart is not None else None
    if wanted is not None:
        mistakes += building_mistakes(wanted, building, ground)
    return wanted, building, mistakes


@contextmanager
def _noted(mistakes: list[HiveError]) -> Iterator[None]:
    """Put an error on the list and go on."""
    try:
        yield
    except HiveError as error:
        mistakes.append(error)


def _summary(fleet: Fleet) -> str:
    """Return what a good fleet has, in a few words."""
    counts = {
        "robot": len(fleet.robots),
        "charger": len(fleet.chargers or ()),
        "zone": len(fleet.zones),
    }
    told = [f"{count} {what}{'s' * (count != 1)}" for what, count in counts.items()]
    return f"{', '.join(told)}; decision {fleet.decision}, traffic {fleet.traffic}"


def main() -> None:
    """Run with this process's arguments; those that ROS adds are left out."""
    launch_fleet([word for word in sys.argv[1:] if ":=" not in word])
