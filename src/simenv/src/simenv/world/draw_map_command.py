# SPDX-License-Identifier: BSD-3-Clause
"""The command `rosrun simenv draw_map`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hive_common.errors import HiveError
from hive_common.map_file import save_map
from simenv.world.draw_map import RESOLUTION, draw_map
from simenv.world.world_file import load_world


def main(arguments: list[str] | None = None) -> int:
    """Draw the map of a world and write it.

    Args:
        arguments: What was typed behind the command; None for what really was.

    Returns:
        0, or 1 if it cannot be done; the reason is printed.
    """
    parser = argparse.ArgumentParser(
        prog="draw_map",
        description="Draw the map that a perfect mapper would make of a world.",
        epilog="example: rosrun simenv draw_map lab maps/lab",
    )
    parser.add_argument("world", help="name of a file in worlds/, or the path of another")
    parser.add_argument("map", type=Path, help="the map's path without suffix")
    parser.add_argument(
        "--resolution", type=float, default=RESOLUTION, help="size of a cell [m] (%(default)s)"
    )
    given = parser.parse_args(arguments)
    try:
        save_map(draw_map(load_world(given.world), given.resolution), given.map)
    except HiveError as error:
        print(f"draw_map: {error}", file=sys.stderr)  # noqa: T201  (a command's one output)
        return 1
    return 0
