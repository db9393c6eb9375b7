# SPDX-License-Identifier: BSD-3-Clause
"""Robots stop at contact, and every contact counts once.

A contact is between a robot and the walls (benches and racks included), an obstacle (a person, a
shut door) or another robot. It begins when a step would take a robot into the other and ends when
there is a gap of `GAP` again. Pushing on without backing off is the same contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simenv.bodies.advance import Advance
from simenv.bodies.footprints import Footprints

if TYPE_CHECKING:
    from hive_common.geometry import Array, Footprint
    from hive_common.pose import Pose
    from simenv.world.surroundings import Surroundings

WALL = ""  # stands for the walls in place of a name
GAP = 0.01  # the gap that ends a contact [m]


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
        self._obstacles = surroundings.obstacles
        self._rows: dict[str, int] = {}
        self._shapes: list[Footprint] = []
        self._touching: set[frozenset[str]] = set()
        self._touched: dict[str, list[str]] | None = {}
        self._advance = Advance(surroundings)
        self.footprints = Footprints([])  # of all robots, in the order of their addition
        self.noted: list[Contact] = []  # every contact so far, once each

    def add(self, name: str, footprint: Footprint) -> None:
        """Add a robot."""
        self._shapes.append(footprint)
        self._count([*self._rows, name])

    def remove(self, name: str) -> None:
        """Forget a robot."""
        del self._shapes[self._rows[name]]
        self._touching = {pair for pair in self._touching if name not in pair}
        self._touched = None
        self._count([each for each in self._rows if each != name])

    def _count(self, names: list[str]) -> None:
        self._rows = {name: row for row, name in enumerate(names)}
        self.footprints = Footprints(self._shapes)
        self._advance.begin(self.footprints)

    def reset(self) -> None:
        """Forget every contact, but keep the robots."""
        self._touching.clear()
        self._touched = {}
        self.noted.clear()

    def advance(
        self, poses: Array, ahead: Array, ways: Array, turns: Array
    ) -> tuple[Array, Array]:
        """Move all robots as far as they can go, and note who was stopped by what.

        Args:
            poses: (n, 3) in the order of their addition, frame map.
            ahead: (n, 3) poses after the full step; may be changed.
            ways: (n,) upper bounds of how far that is [m].
            turns: (n,) upper bounds of how far they turn [rad].

        Returns:
            Poses (n, 3) after the step, and shares (n,) of the step done: 1 if nothing stopped it.
        """
        reached, shares, stops = self._advance.step(poses, ahead, ways, turns)
        if stops:
            robots, things = list(self._rows), self._things()
            for stop in stops:
                self._begin(Contact(robots[stop.row], things[stop.thing], stop.pose))
        if self._touching:
            self._let_go(poses, reached)
        return reached, shares

    def _things(self) -> list[str]:
        """Return the names of all things as `Stop.thing` numbers them."""
        return [WALL, *(each.name for each in self._obstacles.now), *self._rows]

    def _begin(self, contact: Contact) -> None:
        pair = frozenset((contact.name, contact.other))
        if pair not in self._touching:
            self._touching.add(pair)
            self._touched = None
            self.noted.append(contact)

    def touching(self, name: str) -> tuple[str, ...]:
        """Return what a robot touches, sorted: `WALL`, names of obstacles and of robots."""
        if self._touched is None:
            self._touched = {}
            for pair in self._touching:
                for each in pair:
                    self._touched.setdefault(each, []).extend(pair - {each})
        return tuple(sorted(self._touched.get(name, ())))

    def _let_go(self, before: Array, poses: Array) -> None:
        """End the contacts that have a gap now: only where a side has moved since `before`."""
        names = list(self._rows)
        moved = {names[row] for row in (poses != before).any(axis=1).nonzero()[0]}
        stays = self._rows.keys() - moved | {WALL}
        pairs = [pair for pair in sorted(self._touching, key=sorted) if not pair <= stays]
        if not pairs:
            return
        rows = [self._rows[max(pair & self._rows.keys())] for pair in pairs]
        near = self._advance.within(np.array(rows), poses, GAP)
        things = self._things()
        for pair, row, touched in zip(pairs, rows, near, strict=True):
            if not (pair - {names[row]}) & {things[thing] for thing in touched}:
                self._touching.remove(pair)
                self._touched = None
