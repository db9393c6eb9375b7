# SPDX-License-Identifier: BSD-3-Clause
"""The commands `map show` and `map load`: which map everybody uses, and another one for all."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from fleet_manager.cli.context import FileName, ask_first, pass_context, yes_option
from fleet_manager.client import tables
from fleet_manager.client.client import HiveClient
from fleet_manager.client.formats import member, natural
from fleet_manager.client.new_map import PlacedRobot, of_changing_map
from fleet_manager.errors import InputError
from hive_common.errors import FileError, MapError
from hive_common.map_file import load_map
from hive_common.map_id import MapId, checksum_of
from hive_common.resources import find_file

if TYPE_CHECKING:
    from fleet_manager.cli.context import CliContext


@click.group("map")
def map_() -> None:
    """Show which map everybody uses, or have all use another one while they run.

    \b
    Examples:
      hive map show
      hive map load maps/hall_with_new_shelf.yaml
    """  # noqa: D301  (to click, \b means: keep the lines)


@map_.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
@pass_context
def show(context: CliContext, as_json: bool) -> None:
    """Show which map the leader and each robot use, by its name and its checksum.

    A robot that uses another map than the leader gets no tasks until it uses the same. Robots with
    ROS's own navigation tell of the part of them that bids only.
    """
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_robots()
        client.fetch_leader()
        state = client.state
    beat = state.heartbeat
    used = {row.status.robot_id: row.status.map for row in tables.robots_of(state)}
    if as_json:
        of_leader = None if beat is None else beat.map._asdict()
        robots = {name: each._asdict() for name, each in used.items()}
        click.echo(json.dumps({"leader": of_leader, "robots": robots}, indent=2))
        return
    if beat is not None:
        click.echo(f"the leader, {member(beat.leader)}, uses {beat.map}")
    click.echo("\n".join(tables.maps_table(used, None if beat is None else beat.map)))


@map_.command()
@click.argument("file", type=FileName("simenv", "maps"))
@yes_option
@pass_context
def load(context: CliContext, file: str, yes: bool) -> None:
    """Have the map server read FILE, and all robots use that map from now on.

    The map has to be one of the same building in the same frame: robots keep their positions, and
    tasks and places theirs. Robots plan anew, and so does the traffic planner. Places and tasks
    that no robot reaches any more are named first.

    The map server reads the file, so it has to be on its machine, under the same path.

    \b
    Examples:
      hive map load maps/hall_with_new_shelf.yaml
      hive map load lab --yes

    Exits with 0 when every robot uses the map, with 1 if one does not.
    """  # noqa: D301  (to click, \b means: keep the lines)
    try:
        path = find_file("simenv", "maps", file).absolute()
        grid = load_map(str(path))
    except (FileError, MapError) as error:
        raise InputError(str(error)) from None
    wanted = MapId(path.stem, checksum_of(grid))
    with context.connect(()) as link:
        client = HiveClient(link)
        client.fetch_tasks()
        client.fetch_robots()
        records, places = client.state.records.values(), link.places()
        ask_first(of_changing_map(grid, _placed(client), places, records), yes=yes)
        users = client.change_map(path, wanted)
    click.echo(f"{', '.join(sorted(users, key=natural))}: {wanted} is in use", err=True)


def _placed(client: HiveClient) -> list[PlacedRobot]:
    """Return the robots that are heard and whose size is known, where they stand."""
    rows = [row for row in tables.robots_of(client.state) if not row.is_silent]
    sizes = {row: client.link.radius_of(row.status.robot_id) for row in rows}
    return [
        PlacedRobot(row.status.robot_id, row.status.pose, radius)
        for row, radius in sizes.items()
        if radius is not None
    ]
