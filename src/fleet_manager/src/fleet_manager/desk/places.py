# SPDX-License-Identifier: BSD-3-Clause
"""The named places of a world that a task can go to: its stations and chargers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hive_common.pose import Pose

NEAR = 0.75  # [m], how far from its point a robot still counts as at a place


@dataclass(frozen=True, slots=True)
class Place:
    """A named pose.

    Attributes:
        name: As the world file gives it.
        pose: Where a robot stands there [map frame].
    """

    name: str
    pose: Pose


def place_of(pose: Pose, places: tuple[Place, ...]) -> str:
    """Return the name of the place at which something stands; empty when it is at none."""
    if not places or not pose.is_finite:
        return ""
    nearest = min(places, key=lambda place: place.pose.distance_to(pose))
    return nearest.name if nearest.pose.distance_to(pose) <= NEAR else ""
