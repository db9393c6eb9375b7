# SPDX-License-Identifier: BSD-3-Clause
"""The named places of the world that a node was given as a parameter."""

from __future__ import annotations

import rospy

from blackboard.pose import Pose
from fleet_manager.desk.places import Place
from robot_description.errors import FileError
from simenv.errors import WorldError
from simenv.world import load_world


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
        known = load_world(world)
    except (FileError, WorldError) as error:
        rospy.logwarn(f"no place can be chosen by name: {error}")
        return ()
    return tuple(
        Place(place.name, Pose(place.pose.x, place.pose.y, place.pose.yaw))
        for place in (*known.stations, *known.chargers)
    )
