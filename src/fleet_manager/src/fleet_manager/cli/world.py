# SPDX-License-Identifier: BSD-3-Clause
"""The commands `world check` and `world map`: check a world file, and draw its map."""

from __future__ import annotations

from pathlib import Path

import click

from fleet_manager.cli.context import FileName
from fleet_manager.errors import InputError
from hive_common.map_file import FORMATS, save_map
from simenv.errors import SimenvError
from simenv.world.draw_map import RESOLUTION, draw_map
from simenv.world.world_file import load_world, world_mistakes


@click.group()
def world() -> None:
    """Check world files, and draw maps of them."""


@world.command()
@click.argument("file", type=FileName("simenv", "worlds"))
def check(file: str) -> None:
    """Name every mistake in a world FILE, with its line.

    \b
    Examples:
      hive world check lab
      hive world check /path/of/my_world.yaml

    Exits with 0 where there is none, otherwise with 2.
    """  # noqa: D301  (to click, \b means: keep the lines)
    try:
        mistakes = world_mistakes(file)
        found = None if mistakes else load_world(file)
    except SimenvError as error:
        raise InputError(str(error)) from None
    if found is None:
        for mistake in mistakes:
            click.echo(str(mistake), err=True)
        raise InputError(f"{file} has {len(mistakes)} mistake{'s' * (len(mistakes) > 1)}")
    width, depth = found.size
    click.echo(
        f"{file}: good. '{found.name}', {width:g} m x {depth:g} m: {len(found.shapes)} shapes, "
        f"{len(found.doors)} doors, {len(found.stations)} stations, {len(found.chargers)} "
        f"chargers, {len(found.parking)} parking places, {len(found.starts)} starts, "
        f"{len(found.people)} people"
    )


@world.command("map")
@click.argument("file", type=FileName("simenv", "worlds"))
@click.argument("out", required=False, type=click.Path(path_type=Path))
@click.option("--resolution", type=float, default=RESOLUTION, show_default=True, help="[m]")
@click.option("--format", "kind", type=click.Choice(FORMATS), default="pgm", show_default=True)
def draw(file: str, out: Path | None, resolution: float, kind: str) -> None:
    """Draw the map that a perfect mapper would make of a world FILE, as OUT.yaml and OUT.pgm.

    Without OUT, the files are written here under the name of the world.

    \b
    Example:
      hive world map lab maps/lab
    """  # noqa: D301  (to click, \b means: keep the lines)
    try:
        found = load_world(file)
        if out is None and "/" in found.name:
            raise InputError(f"'{found.name}' is not a file name; give OUT as well")
        out = out or Path(found.name)
        grid = draw_map(found, resolution)
        save_map(grid, out, kind=kind)
    except SimenvError as error:
        raise InputError(str(error)) from None
    height, width = grid.cells.shape
    click.echo(f"{out}.yaml, {out}.{kind}: {width} x {height} cells of {resolution:g} m")
