# SPDX-License-Identifier: BSD-3-Clause
"""Looks up the places that a world names, so that an operator can write `dock` for a pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_common.checked_yaml import read_checked
from hive_common.resources import find_file
from simenv.world.world_content import WorldContent

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_common.pose import Pose


def places_of(world: str) -> Mapping[str, Pose]:
    """Return the stations and chargers of a world by name, each with its pose in the map frame.

    The world is given by its name in simenv's `worlds/` without `.yaml`, or by its path.

    Raises:
        hive_common.errors.FileError: There is no such world, or its file has a mistake.
    """
    content = read_checked(find_file("simenv", "worlds", world), WorldContent)
    return {place.name: place.pose for place in (*content.stations, *content.chargers)}
