# SPDX-License-Identifier: BSD-3-Clause
"""The named places of a world: its stations and chargers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hive_common.pose import Pose

NEAR = 0.75  # [m], the distance within which a robot counts as at a place


@dataclass(frozen=True, slots=True)
class Place:
    """A name of the world file, with the pose of a robot that stands there [map frame]."""

    name: str
    pose: Pose


def place_of(pose: Pose, places: tuple[Place, ...]) -> str:
    """Return the name of the place at a pose; empty where there is none."""
    if not places or not pose.is_finite:
        return ""
    nearest = min(places, key=lambda place: place.pose.distance_to(pose))
    return nearest.name if nearest.pose.distance_to(pose) <= NEAR else ""
