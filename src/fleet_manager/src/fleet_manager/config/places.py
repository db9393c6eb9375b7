# SPDX-License-Identifier: BSD-3-Clause
"""Looks up the places that a world names, so that an operator can write `dock` for a pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_common.checked_yaml import read_checked
from hive_common.landmark import Landmark
from hive_common.resources import find_file
from simenv.world.world_content import WorldContent

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.domain.charger import Charger
    from hive_common.pose import Pose
    from simenv.world.world import World


def places_of(world: str) -> Mapping[str, Pose]:
    """Return the stations and chargers of a world by name, each with its pose in the map frame.

    The world is given by its name in simenv's `worlds/` without `.yaml`, or by its path.

    Raises:
        hive_common.errors.FileError: There is no such world, or its file has a mistake.
    """
    content = read_checked(find_file("simenv", "worlds", world), WorldContent)
    return {place.name: place.pose for place in (*content.stations, *content.chargers)}


def landmarks_of(world: World | None, chargers: Iterable[Charger]) -> tuple[Landmark, ...]:
    """Return by what names people know the places of a building.

    Args:
        world: The simulated building; None for a real one, of which nothing but chargers is known.
        chargers: Those that robots use.
    """
    goals = {each.name: each.pose for each in chargers}
    doors = []
    if world is not None:
        goals |= {each.name: each.pose for each in (*world.stations, *world.parking)}
        middles = [(door.name, door.area.centroid) for door in world.doors]
        doors = [
            Landmark(name=name, at=(float(middle.x), float(middle.y)), is_goal=False)
            for name, middle in middles
        ]
    places = [Landmark(name=name, at=(pose.x, pose.y)) for name, pose in goals.items()]
    return (*places, *doors)
