# SPDX-License-Identifier: BSD-3-Clause
"""Robots stop at contact, and every contact counts once.

A contact is between a robot and the walls (benches and racks included), an obstacle (a person, a
shut door) or another robot. It begins when a step would take a robot into the other and ends when
there is a gap of `GAP` again. Pushing on without backing off is the same contact.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose
from simenv.bodies.advance import advance
from simenv.bodies.footprints import Footprints

if TYPE_CHECKING:
    from hive_common.geometry import Array, Footprint, Indices
    from simenv.world.surroundings import Surroundings

WALL = ""  # stands for the walls in place of a name
GAP = 0.01  # the gap that ends a contact [m]
GONE = -1  # the number of an obstacle that is no longer there


@dataclass(frozen=True)
class Contact:
    """A robot ran into something."""

    name: str  # the robot that moved
    other: str  # the robot or obstacle it ran into, or `WALL`
    pose: Pose  # where it was stopped, frame map

    def __str__(self) -> str:
        return f"{self.name} ran into {self.other or 'a wall'} at {self.pose}"


class Contacts:
    """Stops robots at what is solid, and notes every contact."""

    def __init__(self, surroundings: Surroundings) -> None:
        """Begin without robots."""
        self._surroundings = surroundings
        self._shapes: dict[str, Footprint] = {}
        self._touching: list[tuple[str, str]] = []  # a robot, and what it touches
        self._touched: dict[str, list[str]] = {}
        self._things: list[str] = []  # the walls, all obstacles, all robots
        self._pairs: Indices = np.zeros((0, 2), dtype=np.int64)  # `_touching` in numbers
        self._changes = -1
        self.footprints = Footprints([])  # of all robots, in the order of their addition
        self.noted: list[Contact] = []  # every contact so far, once each

    def add(self, name: str, footprint: Footprint) -> None:
        """Add a robot."""
        self._shapes[name] = footprint
        self._count()

    def remove(self, name: str) -> None:
        """Forget a robot."""
        del self._shapes[name]
        self._touching = [pair for pair in self._touching if name not in pair]
        self._count()

    def _count(self) -> None:
        self.footprints = Footprints(list(self._shapes.values()))
        self._number()

    def reset(self) -> None:
        """Forget every contact, but keep the robots."""
        self._touching.clear()
        self._number()
        self.noted.clear()

    def _number(self) -> None:
        """Work out anew what follows from the robots, the obstacles and `_touching`."""
        obstacles = self._surroundings.obstacles
        self._changes = obstacles.changes
        self._things = [WALL, *(each.name for each in obstacles.now), *self._shapes]
        numbers = {name: number for number, name in enumerate(self._things)}
        pairs = [(numbers[name], numbers.get(other, GONE)) for name, other in self._touching]
        self._pairs = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        self._touched = {}
        for name, other in self._touching:
            self._touched.setdefault(name, []).append(other)
            self._touched.setdefault(other, []).append(name)

    def advance(self, poses: Array, ahead: Array, shifts: Array) -> tuple[Array, Array]:
        """Move all robots as far as they can go, and note who was stopped by what.

        Args:
            poses: (n, 3) in the order of their addition, frame map.
            ahead: (n, 3) poses after the full step.
            shifts: (n, 3) upper bounds of how far that is along x, y and yaw [m, m, rad].

        Returns:
            Poses (n, 3) after the step, and shares (n,) of the step done: 1 if nothing stopped it.
        """
        if self._surroundings.obstacles.changes != self._changes:
            self._number()
        shapes, number = self.footprints, len(self._things) - len(poses)
        ways = np.hypot(shifts[:, 0], shifts[:, 1])
        near = self._surroundings.near(ahead, shapes.radii + ways + 2 * GAP)
        reached, shares, begun, touching = advance(
            poses,
            ahead,
            ways + shapes.radii * np.abs(shifts[:, 2]),
            shapes.points,
            shapes.lines,
            shapes.radii,
            near.segments,
            near.things,
            near.starts,
            number,
            self._pairs,
            GAP,
        )
        if not touching.all() or len(begun):
            for robot, thing in begun.tolist():
                pair = (self._things[robot], self._things[thing])
                self._touching.append(pair)
                self.noted.append(Contact(*pair, Pose(*reached[robot - number].tolist())))
            self._touching = list(itertools.compress(self._touching, touching))
            self._number()
        return reached, shares

    def touching(self, name: str) -> tuple[str, ...]:
        """Return what a robot touches, sorted: `WALL`, names of obstacles and of robots."""
        return tuple(sorted(self._touched.get(name, ())))
