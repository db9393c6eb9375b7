# SPDX-License-Identifier: BSD-3-Clause
"""Reads world files, and finds every mistake in one with its line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs

from hive_common.checked_yaml import error_at, read_all_mistakes
from hive_common.resources import find_file
from hive_common.structuring import NotAllowedError
from simenv.world.shapes import HEIGHTS, Door, Shape, area_of
from simenv.world.world import World
from simenv.world.world_content import WorldContent

if TYPE_CHECKING:
    from pathlib import Path

    from hive_common.errors import FileError


def load_world(name_or_path: str) -> World:
    """Read and check a world.

    Args:
        name_or_path: The name of a world of this package (`lab`), or the path of a YAML file.

    Raises:
        FileError: There is no such file, or it holds something that is not allowed.
    """
    world, mistakes = _read(world_path(name_or_path))
    if world is None or mistakes:
        raise mistakes[0]
    return world


def world_mistakes(name_or_path: str) -> list[FileError]:
    """Return all mistakes in a world file, each with its line.

    Args:
        name_or_path: The name of a world of this package (`lab`), or the path of a YAML file.

    Raises:
        FileError: There is no such file, or it cannot be read at all.
    """
    return _read(world_path(name_or_path))[1]


def world_path(name_or_path: str) -> Path:
    """Return the file of a world; raise FileError if there is none of that name."""
    return find_file("simenv", "worlds", name_or_path)


def _read(path: Path) -> tuple[World | None, list[FileError]]:
    """Return a world, and its mistakes: first those in single values, then contradictions."""
    content, mistakes = read_all_mistakes(path, WorldContent)
    if content is None:
        return None, mistakes
    shapes: list[Shape] = []
    for kind, default in HEIGHTS.items():
        for index, entry in enumerate(getattr(content, kind)):
            height = entry.height or default
            try:
                area = area_of(entry)
            except NotAllowedError as error:
                mistakes.append(error_at(path, (kind, index, *error.place), error.problem))
            else:
                shapes.append(
                    Door(entry.name, area, kind, height, open=entry.open)
                    if kind == "doors"
                    else Shape(entry.name, area, kind, height)
                )
    if mistakes:
        return None, mistakes
    world = World(
        content.name,
        content.size,
        shapes=tuple(shape for shape in shapes if not isinstance(shape, Door)),
        doors=tuple(shape for shape in shapes if isinstance(shape, Door)),
        stations=content.stations,
        chargers=content.chargers,
        starts=content.starts,
        parking=content.parking,
        people=content.people,
    )
    return world, [error_at(path, _place(content, m.name), m.text) for m in world.mistakes()]


def _place(content: WorldContent, name: str) -> tuple[str | int, ...]:
    """Return where in a world file the last thing of that name stands."""
    lists = attrs.asdict(content, recurse=False, filter=lambda field, _: field.name != "size")
    return [
        (kind, index)
        for kind, items in lists.items()
        if isinstance(items, tuple)
        for index, item in enumerate(items)
        if item.name == name
    ][-1]
