# SPDX-License-Identifier: BSD-3-Clause
"""The named places of the world that a node was given as a parameter."""

from __future__ import annotations

import rospy

from fleet_manager.config.places import places_of
from fleet_manager.desk.places import Place
from fleet_manager.errors import InputError
from hive_common.errors import FileError


def world_places(world: str) -> tuple[Place, ...]:
    """Return a world's stations and chargers, in the order of its file.

    Args:
        world: Name of a world or path of its file; empty where there is none.

    Returns:
        Its places; none, with a warning in the node's log, where the file cannot be read.
    """
    if not world:
        return ()
    try:
        return tuple(Place(name, pose) for name, pose in places_of(world).items())
    except (FileError, InputError) as error:
        rospy.logwarn(f"no place can be chosen by name: {error}")
        return ()
