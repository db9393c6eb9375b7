# SPDX-License-Identifier: BSD-3-Clause
"""Reads world files, and finds every mistake in one with its line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hive_common.checked_yaml import error_at, read_all_mistakes, read_checked
from hive_common.pose import Pose
from hive_common.resources import find_file
from simenv.errors import WorldError
from simenv.world.shapes import Door, shape_from
from simenv.world.world import Person, Place, Station, World
from simenv.world.world_schema import PLACE_KINDS, SCHEMA, SOLID_KINDS

if TYPE_CHECKING:
    from pathlib import Path

    from hive_common.errors import FileError


class _Unchecked(World):
    """A world whose mistakes are sought one by one instead of ending its making."""

    def __post_init__(self) -> None:
        """Refuse nothing."""


def load_world(name_or_path: str) -> World:
    """Read and check a world.

    Args:
        name_or_path: The name of a world of this package (`lab`), or the path of a YAML file.

    Raises:
        FileError: There is no such file, or it holds something that is not allowed.
    """
    path = world_path(name_or_path)
    content = read_checked(path, SCHEMA)
    mistakes = _contradictions(path, content)
    if mistakes:
        raise mistakes[0]
    return _world(content, World)


def world_mistakes(name_or_path: str) -> list[FileError]:
    """Return everything that is wrong with a world file, each with its line.

    Args:
        name_or_path: The name of a world of this package (`lab`), or the path of a YAML file.

    Raises:
        FileError: There is no such file, or it cannot be read at all.
    """
    path = world_path(name_or_path)
    content, mistakes = read_all_mistakes(path, SCHEMA)
    return mistakes or _contradictions(path, content)


def world_path(name_or_path: str) -> Path:
    """Return the file of a world.

    Raises:
        FileError: There is no world of that name.
    """
    return find_file("simenv", "worlds", name_or_path)


def _contradictions(path: Path, content: dict[str, Any]) -> list[FileError]:
    """Return the mistakes that a schema cannot see, from the top of the file down."""
    found: list[tuple[tuple[str | int, ...], str]] = []
    for kind in (*SOLID_KINDS, "doors"):
        for index, item in enumerate(content.get(kind, [])):
            try:
                shape_from(item, kind)
            except WorldError as error:
                found.append(((kind, index), str(error)))
    if not found:
        world = _world(content, _Unchecked)
        found = [(_keys(content, m.name), m.text) for m in World.mistakes(world)]
    return [error_at(path, keys, text) for keys, text in found]


def _keys(content: dict[str, Any], name: str) -> tuple[str | int, ...]:
    """Return where the last thing of that name is in a world file."""
    return [
        (kind, index)
        for kind, items in content.items()
        if isinstance(items, list) and kind != "size"
        for index, item in enumerate(items)
        if item["name"] == name
    ][-1]


def _world(content: dict[str, Any], kind_of_world: type[World]) -> World:
    """Build a world from what its file holds."""
    solid = [shape_from(item, kind) for kind in SOLID_KINDS for item in content.get(kind, [])]
    doors = [shape_from(item, "doors") for item in content.get("doors", [])]
    places = {
        kind: tuple(Place(item["name"], _pose(item)) for item in content.get(kind, []))
        for kind in PLACE_KINDS
    }
    return kind_of_world(
        name=content["name"],
        size=(content["size"][0], content["size"][1]),
        shapes=tuple(solid),
        stations=tuple(Station(**(i | {"pose": _pose(i)})) for i in content.get("stations", [])),
        doors=tuple(door for door in doors if isinstance(door, Door)),
        people=tuple(_person(item) for item in content.get("people", [])),
        **places,
    )


def _person(item: dict[str, Any]) -> Person:
    route = tuple((float(x), float(y)) for x, y in item["route"])
    return Person(**(item | {"route": route}))


def _pose(item: dict[str, Any]) -> Pose:
    return Pose(*map(float, item["pose"]))
