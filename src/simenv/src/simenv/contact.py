# SPDX-License-Identifier: BSD-3-Clause
"""Nothing drives through anything: robots stop at contact, and every contact is counted once.

A contact is between a robot and the walls (benches and racks are walls here), an obstacle (a
person, a shut door) or another robot. It begins when a step would take a robot into the other, and
ends when there is a gap of `GAP` again; pushing on, or pushing again without backing off, is the
same contact.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robot_description.follower import Pose
from simenv.geometry import Footprint, outline, wrap

if TYPE_CHECKING:
    from collections.abc import Mapping

    from simenv.geometry import Nearby
    from simenv.obstacles import Obstacles

WALL = ""
"""Stands for the walls where a robot's name would stand."""

GAP = 0.01
"""The gap that ends a contact [m]."""

CLOSE = 1 / 64
"""A step that is cut short ends within this share of its length before the contact."""


@dataclass(frozen=True)
class Contact:
    """That a robot ran into something.

    Attributes:
        name: The robot that moved.
        other: The robot or obstacle it ran into, or `WALL`.
        pose: Where it was stopped, frame map.
    """

    name: str
    other: str
    pose: Pose

    def __str__(self) -> str:
        return f"{self.name} ran into {self.other or 'a wall'} at {self.pose}"


class Contacts:
    """Stops robots at what is solid and notes how often that was needed.

    Attributes:
        noted: Every contact so far, once each.
    """

    def __init__(self, near: Nearby, obstacles: Obstacles) -> None:
        """Take the walls, and what else is in the way."""
        self._near = near
        self._obstacles = obstacles
        self._footprints: dict[str, Footprint] = {}
        self._touching: set[frozenset[str]] = set()
        self.noted: list[Contact] = []

    def add(self, name: str, footprint: Footprint) -> None:
        """Take in a robot."""
        self._footprints[name] = footprint

    def remove(self, name: str) -> None:
        """Forget a robot."""
        del self._footprints[name]
        self._touching = {pair for pair in self._touching if name not in pair}

    def reset(self) -> None:
        """Forget every contact; the robots stay known."""
        self._touching.clear()
        self.noted.clear()

    def in_the_way(
        self, name: str, pose: Pose, poses: Mapping[str, Pose], margin: float = 0.0
    ) -> list[str]:
        """Return what a robot would touch.

        Args:
            name: The robot.
            pose: Where it would stand.
            poses: Where all robots stand now.
            margin: By how much the robot is taken to be larger [m].

        Returns:
            `WALL`, names of obstacles and of robots; empty where the way is free.
        """
        mine = self._footprints[name]
        reach = mine.radius + margin
        found = []
        if mine.touches(pose, self._near.at(pose.x, pose.y, reach), margin):
            found.append(WALL)
        found += [
            obstacle.name
            for obstacle in self._obstacles.near(pose.x, pose.y, reach)
            if mine.touches(pose, obstacle.edges, margin)
        ]
        for other, there in poses.items():
            theirs = self._footprints[other]
            close = math.dist(pose[:2], there[:2]) <= reach + theirs.radius
            if other != name and close:
                edges = outline(theirs.at(there))
                if mine.touches(pose, edges, margin):
                    found.append(other)
        return found

    def advance(self, name: str, pose: Pose, poses: Mapping[str, Pose]) -> tuple[Pose, float]:
        """Move a robot as far as it can go.

        Args:
            name: The robot.
            pose: Where it would be after the step.
            poses: Where all robots stand now.

        Returns:
            Where it is after the step, and what share of the step it went: 1 if nothing
            stopped it.
        """
        met = self.in_the_way(name, pose, poses)
        if not met:
            return pose, 1.0
        start = poses[name]
        free, blocked, probe = 0.0, 1.0, CLOSE  # a robot that pushes on gets no farther than this
        while blocked - free > CLOSE:
            met_there = self.in_the_way(name, _between(start, pose, probe), poses)
            if met_there:
                blocked, met = probe, met_there
            else:
                free = probe
            probe = (free + blocked) / 2
        stopped = _between(start, pose, free)
        for other in met:
            self._begin(Contact(name, other, stopped))
        return stopped, free

    def _begin(self, contact: Contact) -> None:
        pair = frozenset((contact.name, contact.other))
        if pair not in self._touching:
            self._touching.add(pair)
            self.noted.append(contact)

    def touching(self, name: str) -> tuple[str, ...]:
        """Return what a robot touches, sorted: `WALL`, names of obstacles and of robots."""
        return tuple(
            sorted(other for pair in self._touching if name in pair for other in pair - {name})
        )

    def let_go(self, poses: Mapping[str, Pose]) -> None:
        """End the contacts between which there is a gap now."""
        for pair in sorted(self._touching, key=sorted):
            name = max(pair & self._footprints.keys())
            still = self.in_the_way(name, poses[name], poses, margin=GAP)
            if not (pair - {name}) & set(still):
                self._touching.remove(pair)


def _between(start: Pose, end: Pose, share: float) -> Pose:
    """Return the pose at `share` (0..1) of a short way; the yaw goes the shorter way round."""
    return Pose(
        start.x + share * (end.x - start.x),
        start.y + share * (end.y - start.y),
        start.yaw + share * wrap(end.yaw - start.yaw),
    )
