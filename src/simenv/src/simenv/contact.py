# SPDX-License-Identifier: BSD-3-Clause
"""Nothing drives through anything: robots stop at contact, and every contact is counted once.

A contact is between a robot and the walls (benches and racks are walls here), an obstacle (a
person, a shut door) or another robot. It begins when a step would take a robot into the other, and
ends when there is a gap of `GAP` again; pushing on, or pushing again without backing off, is the
same contact.

Most robots run into nothing in most steps. All that surely do not are found in one go; the others
are moved one after the other, each as far as it can go among those that have been moved before it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from robot_description.follower import Pose
from simenv.footprints import Footprints
from simenv.geometry import outline, wrap

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from simenv.geometry import Array, Footprint
    from simenv.surroundings import Surroundings

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

    def __init__(self, surroundings: Surroundings) -> None:
        """Take what there is besides the robots."""
        self._surroundings = surroundings
        self._footprints: dict[str, Footprint] = {}
        self._names: list[str] = []
        self._all = Footprints([])
        self._touching: set[frozenset[str]] = set()
        self.noted: list[Contact] = []

    def add(self, name: str, footprint: Footprint) -> None:
        """Take in a robot."""
        self._footprints[name] = footprint
        self._count()

    def remove(self, name: str) -> None:
        """Forget a robot."""
        del self._footprints[name]
        self._touching = {pair for pair in self._touching if name not in pair}
        self._count()

    def _count(self) -> None:
        self._names = list(self._footprints)
        self._all = Footprints(list(self._footprints.values()))

    @property
    def footprints(self) -> Footprints:
        """Those of all robots, in the order in which they were taken in."""
        return self._all

    def reset(self) -> None:
        """Forget every contact; the robots stay known."""
        self._touching.clear()
        self.noted.clear()

    def advance(self, poses: Array, ahead: Array) -> tuple[Array, Array]:
        """Move all robots as far as they can go.

        Args:
            poses: (n, 3) where they stand, in the order in which they were taken in, frame map.
            ahead: (n, 3) where they would be after the step.

        Returns:
            (n, 3) where they are after the step, and (n,) what share of the step they went: 1 if
            nothing stopped them.
        """
        moving = (ahead != poses).any(axis=1)
        free = moving & ~self._perhaps_met(poses, ahead, moving)
        reached = np.where(free[:, None], ahead, poses)
        shares = np.ones(len(poses))
        for row in np.flatnonzero(moving & ~free):
            pose, shares[row] = self._advance(row, Pose(*ahead[row].tolist()), reached)
            reached[row] = pose
        return reached, shares

    def _perhaps_met(
        self, poses: Array, ahead: Array, moving: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Return (n,) which robots may touch something; those that it leaves out do not.

        While a robot moves, so may the others. None of them gets farther from where it stood than
        its step is long, and by so much the first one is taken to be larger.
        """
        radii, corners = self._all.radii, self._all.corners
        shifts = ahead - poses
        turns = np.abs(np.remainder(shifts[:, 2] + np.pi, 2 * np.pi) - np.pi)
        steps = np.hypot(shifts[:, 0], shifts[:, 1]) + radii * turns
        x, y = (ahead[:, None, :2] - poses[:, :2]).transpose(2, 0, 1)
        near = (np.hypot(x, y) <= radii[:, None] + (radii + steps)) & moving[:, None]
        np.fill_diagonal(near, val=False)
        rows, others = near.nonzero()
        movers = moving.nonzero()[0]
        segments, owners = self._surroundings.near_all(ahead[movers], radii[movers])
        which, margins = movers[owners], np.zeros(len(owners))
        if len(rows):
            edges = self._all.outlines(others, poses[others]).reshape(-1, 2, 2)
            segments = np.concatenate([segments, edges])
            which = np.concatenate([which, rows.repeat(corners)])
            margins = np.concatenate([margins, steps[others].repeat(corners)])
        if not len(segments):
            return np.zeros(len(poses), dtype=bool)
        met = self._all.touched(which, ahead[which], segments, margins)
        return np.bincount(which[met], minlength=len(poses)) > 0

    def _near(self, row: int, pose: Pose, poses: Array, reach: float) -> _Near:
        """Return what is within `reach` [m] of a robot's base at `pose`, and some more."""
        x, y = pose.x, pose.y
        found = [(WALL, self._surroundings.walls.at(x, y, reach))]
        found += [
            (each.name, each.edges) for each in self._surroundings.obstacles.near(x, y, reach)
        ]
        apart = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
        for other in np.flatnonzero(apart <= reach + self._all.radii).tolist():
            if other != row:
                name = self._names[other]
                corners = self._footprints[name].at(Pose(*poses[other].tolist()))
                found.append((name, outline(corners)))
        return _Near(self._footprints[self._names[row]], found)

    def _advance(self, row: int, pose: Pose, poses: Array) -> tuple[Pose, float]:
        """Move one robot as far as it can go; see `advance`."""
        start = Pose(*poses[row].tolist())
        way = math.dist(start[:2], pose[:2])
        near = self._near(row, pose, poses, float(self._all.radii[row]) + way)
        met = near.met(pose)
        if not met:
            return pose, 1.0
        free, blocked, probe = 0.0, 1.0, CLOSE  # a robot that pushes on gets no farther than this
        while blocked - free > CLOSE:
            met_there = near.met(_between(start, pose, probe))
            if met_there:
                blocked, met = probe, met_there
            else:
                free = probe
            probe = (free + blocked) / 2
        stopped = _between(start, pose, free)
        for other in met:
            self._begin(Contact(self._names[row], other, stopped))
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

    def let_go(self, before: Array, poses: Array) -> None:
        """End the contacts between which there is a gap now.

        Args:
            before: (n, 3) where the robots stood before the step, frame map.
            poses: (n, 3) where they stand now; no gap has come where neither side has moved.
        """
        moved = {self._names[row] for row in (poses != before).any(axis=1).nonzero()[0]}
        stays = self._footprints.keys() - moved | {WALL}
        for pair in sorted(self._touching, key=sorted):
            if pair <= stays:
                continue
            name = max(pair & self._footprints.keys())
            row = self._names.index(name)
            pose = Pose(*poses[row].tolist())
            near = self._near(row, pose, poses, float(self._all.radii[row]) + GAP)
            if not (pair - {name}) & set(near.met(pose, GAP)):
                self._touching.remove(pair)


class _Near:
    """What one robot could touch.

    Args:
        footprint: Of the robot.
        things: `WALL` or a name, and the edges (k, 2, 2) of each thing, frame map [m].
    """

    def __init__(self, footprint: Footprint, things: Sequence[tuple[str, Array]]) -> None:
        self._footprint = footprint
        self._names = [name for name, _ in things]
        self._segments = np.concatenate([edges for _, edges in things])
        self._ends = np.cumsum([len(edges) for _, edges in things])

    def met(self, pose: Pose, margin: float = 0.0) -> list[str]:
        """Return what the robot touches at a pose, taken to be larger by a margin [m]."""
        touched = np.flatnonzero(self._footprint.touched(pose, self._segments, margin))
        things = np.unique(np.searchsorted(self._ends, touched, side="right"))
        return [self._names[thing] for thing in things]


def _between(start: Pose, end: Pose, share: float) -> Pose:
    """Return the pose at `share` (0..1) of a short way; the yaw goes the shorter way round."""
    return Pose(
        start.x + share * (end.x - start.x),
        start.y + share * (end.y - start.y),
        start.yaw + share * wrap(end.yaw - start.yaw),
    )
