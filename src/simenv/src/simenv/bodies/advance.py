# SPDX-License-Identifier: BSD-3-Clause
"""How far robots can go in a step until something stops them.

In most steps most robots run into nothing. `clearance` knows most of these without a check, and
one check of the rest finds the others. The remaining robots move one after the other, each as far
as it can among those that moved before it; robots too far apart to matter move together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_common.pose import Pose
from simenv.bodies.clearance import Clearance
from simenv.bodies.footprints import Footprints
from simenv.world.surroundings import Near

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array, Indices
    from simenv.world.surroundings import Surroundings

CLOSE = 1 / 64  # a step that is cut short ends before the contact, within this share of its length


class Stop(NamedTuple):
    """A robot that something stopped."""

    row: int  # the robot
    thing: int  # what stopped it: a number of `Near.things`; robots follow after the obstacles
    pose: Pose  # where it was stopped, frame map


class Advance:
    """Moves n robots; row i of every array belongs to robot i."""

    def __init__(self, surroundings: Surroundings) -> None:
        """Begin without robots."""
        self._surroundings = surroundings
        self._clearance = Clearance(surroundings)
        self._all = Footprints([])

    def begin(self, footprints: Footprints) -> None:
        """Begin with these robots."""
        self._all = footprints
        self._clearance.begin(footprints.radii)

    def step(
        self, poses: Array, ahead: Array, ways: Array, turns: Array
    ) -> tuple[Array, Array, list[Stop]]:
        """Move all robots as far as they can go; see `Contacts.advance`.

        Returns:
            Poses (n, 3) after the step, frame map; shares (n,) of the step done; and the stops, in
            the order of the robots.
        """
        shares = np.ones(len(poses))
        swings = ways + self._all.radii * turns
        rows = self._clearance.doubtful(poses, ways, swings)
        if len(rows):
            rows = rows[self._perhaps_met(rows, poses, ahead, swings)]
        stops: list[Stop] = []
        reached = ahead
        if len(rows):
            reached = ahead.copy()
            reached[rows] = poses[rows]
            for batch in self._batches(rows, poses, swings):
                stops += self._push(batch, ahead[batch], ways[batch], reached, shares)
        return reached, shares, sorted(stops, key=lambda stop: stop[:2])

    def within(self, rows: Indices, poses: Array, margin: float) -> list[set[int]]:
        """Return what would touch the robots `rows` (k,) if they were larger by `margin` [m].

        The things are numbered as in `Stop.thing`; `poses` (n, 3) is where all robots stand.
        """
        near = self._near(rows, poses[rows], self._all.radii[rows] + margin, poses)
        met = self._touched(rows, poses[rows], near, margin)
        return [set(near.things[met & (near.places == i)].tolist()) for i in range(len(rows))]

    def _perhaps_met(
        self, rows: Indices, poses: Array, ahead: Array, swings: Array
    ) -> NDArray[np.bool_]:
        """Return (k,) which of some robots may touch something; the others surely do not.

        The others may move meanwhile, each at most by the length of its step. By so much the first
        robot counts as larger.
        """
        radii, corners = self._all.radii, self._all.corners
        places = ahead[rows]
        who, others = self._pairs(rows, places, poses, radii[rows], radii + swings)
        segments, owners, _ = self._surroundings.near(places, radii[rows])
        margins = np.zeros(len(owners))
        if len(who):
            edges = self._all.outlines(others, poses[others]).reshape(-1, 2, 2)
            segments = np.concatenate([segments, edges])
            owners = np.concatenate([owners, who.repeat(corners)])
            margins = np.concatenate([margins, swings[others].repeat(corners)])
        met = self._all.touched(rows[owners], places[owners], segments, margins)
        return np.bincount(owners[met], minlength=len(rows)) > 0

    def _pairs(
        self, rows: Indices, places: Array, poses: Array, reaches: Array, sizes: Array
    ) -> tuple[Indices, Indices]:
        """Return pairs of one of k places, `reaches` [m] large, and another robot near it."""
        x, y = (places[:, None, :2] - poses[:, :2]).transpose(2, 0, 1)
        near = np.hypot(x, y) <= reaches[:, None] + sizes
        near[np.arange(len(rows)), rows] = False
        who, others = near.nonzero()
        return who, others

    def _near(self, rows: Indices, places: Array, reaches: Array, poses: Array) -> Near:
        """Return what is within `reaches` (k,) [m] of k places, and some more.

        Args:
            rows: (k,) the robots that are or will be there, which do not count.
            places: (k, 3) frame map.
            reaches: (k,) [m]
            poses: (n, 3) where all robots stand, frame map.
        """
        found = self._surroundings.near(places, reaches)
        who, others = self._pairs(rows, places, poses, reaches, self._all.radii)
        if not len(who):
            return found
        corners = self._all.corners
        first = 1 + len(self._surroundings.obstacles.now)
        return Near(
            np.concatenate(
                [found.segments, self._all.outlines(others, poses[others]).reshape(-1, 2, 2)]
            ),
            np.concatenate([found.places, who.repeat(corners)]),
            np.concatenate([found.things, (others + first).repeat(corners)]),
        )

    def _touched(
        self, rows: Indices, places: Array, near: Near, margin: float = 0.0
    ) -> NDArray[np.bool_]:
        """Return which segments near k robots touch them at `places` (k, 3)."""
        owners = near.places
        margins = np.full(len(owners), margin)
        return self._all.touched(rows[owners], places[owners], near.segments, margins)

    def _batches(self, rows: Indices, poses: Array, swings: Array) -> list[Indices]:
        """Group robots (k,) so that each moves after the near ones before it in the list."""
        if len(rows) == 1:
            return [rows]
        reach = self._all.radii[rows] + swings[rows]
        x, y = (poses[rows, None, :2] - poses[rows, :2]).transpose(2, 0, 1)
        before = np.tril(np.hypot(x, y) <= reach[:, None] + reach, -1)
        turns = np.zeros(len(rows), dtype=int)
        for i in before.any(axis=1).nonzero()[0]:
            turns[i] = 1 + turns[before[i]].max()
        return [rows[turns == turn] for turn in range(turns.max() + 1)]

    def _push(
        self, rows: Indices, ahead: Array, ways: Array, reached: Array, shares: Array
    ) -> list[Stop]:
        """Move robots that are not near each other as far as they can go.

        Args:
            rows: (k,) the robots.
            ahead: (k, 3) poses after the full step.
            ways: (k,) how far that is [m].
            reached: (n, 3) poses of all robots; updated.
            shares: (n,) shares of the step done; updated.
        """
        start = reached[rows]
        near = self._near(rows, ahead, self._all.radii[rows] + ways, reached)
        met = self._touched(rows, ahead, near)
        stopped = np.bincount(near.places[met], minlength=len(rows)) > 0
        free, blocked = np.where(stopped, 0.0, 1.0), np.ones(len(rows))
        probe = np.full(len(rows), CLOSE)  # a robot that pushes on gets no farther
        while (unsure := blocked - free > CLOSE).any():
            met_there = self._touched(rows, _between(start, ahead, probe), near)
            blocks = unsure & (np.bincount(near.places[met_there], minlength=len(rows)) > 0)
            met = np.where(blocks[near.places], met_there, met)
            blocked = np.where(blocks, probe, blocked)
            free = np.where(unsure & ~blocks, probe, free)
            probe = (free + blocked) / 2
        reached[rows] = np.where(stopped[:, None], _between(start, ahead, free), ahead)
        shares[rows] = free
        return [
            Stop(int(rows[i]), thing, Pose(*reached[rows[i]].tolist()))
            for i in stopped.nonzero()[0]
            for thing in np.unique(near.things[met & (near.places == i)]).tolist()
        ]


def _between(start: Array, end: Array, shares: Array) -> Array:
    """Return the poses (k, 3) at `shares` (k,) of the way; yaws take the shorter turn."""
    way = end - start
    way[:, 2] = np.remainder(way[:, 2] + np.pi, 2 * np.pi) - np.pi
    found: Array = start + shares[:, None] * way
    return found
