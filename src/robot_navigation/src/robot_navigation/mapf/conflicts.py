# SPDX-License-Identifier: BSD-3-Clause
"""What a robot blocks for another one, at each place and along each lane of a roadmap.

Places and ways are what robots reserve. A way is a lane and its reverse lane, one after the other
in no particular order; way k has the number n + k behind the n places. A robot at a place, or
at some fraction of a lane, blocks every place and way that is nearer to it than both radii and
the gap. So a robot that drives needs its way and the place at its end free for the whole drive,
however fast either of the two is; this is what an order of robots at places can ensure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import spatial

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices
    from robot_navigation.mapf.roadmap import Roadmap

TINY = 1e-6  # robots that are this much too near to each other do not touch [m]


@dataclass(frozen=True)
class Conflicts:
    """What a robot that stands or drives blocks for another one.

    An action is standing at place i, number i, or driving along lane k, number n + k.

    Attributes:
        begins: (n + m + 1,) array: action a blocks `blocked[begins[a]:begins[a + 1]]`.
        blocked: Numbers of places and ways.
        spans: (k, 2) array, from and to which fraction of the lane each is blocked, 0..1.
    """

    begins: Indices
    blocked: Indices
    spans: Array


def ways(roadmap: Roadmap) -> Indices:
    """Return the number of each lane's way, (m,), from 0; a lane shares it with its reverse."""
    pairs = np.sort(roadmap.lanes, axis=1)
    keys = pairs[:, 0] * len(roadmap.places) + pairs[:, 1]
    numbers: Indices = np.unique(keys, return_inverse=True)[1].astype(np.intp)
    return numbers


def classical_conflicts(roadmap: Roadmap) -> Conflicts:
    """Return the conflicts of the classical problem: no two robots at a place, none swap places.

    A robot may drive to a place while another one leaves it (Stern et al., Multi-Agent Pathfinding:
    Definitions, Variants, and Benchmarks, SoCS 2019).
    """
    count, lanes = len(roadmap.places), len(roadmap.lanes)
    blocked = np.column_stack([roadmap.lanes[:, 1], count + ways(roadmap)]).reshape(-1)
    begins = np.concatenate([np.arange(count), count + 2 * np.arange(lanes + 1)])
    spans = np.tile([0.0, 1.0], (count + 2 * lanes, 1))
    everything = np.concatenate([np.arange(count), blocked])
    return Conflicts(begins.astype(np.intp), everything.astype(np.intp), spans)


def spatial_conflicts(roadmap: Roadmap, apart: float) -> Conflicts:
    """Return what robots block that must stay `apart` from each other, centre to centre [m]."""
    limit = max(apart - TINY, 0.0)
    number = ways(roadmap)
    first = np.unique(number, return_index=True)[1]
    count = len(roadmap.places)
    begin, end = roadmap.places[roadmap.lanes[:, 0]], roadmap.places[roadmap.lanes[:, 1]]
    # A place is a lane of no length, so one calculation does for both.
    from_ = np.vstack([roadmap.places, begin])
    to = np.vstack([roadmap.places, end])
    one_end = np.vstack([roadmap.places, begin[first]])
    other_end = np.vstack([roadmap.places, end[first]])
    actions, things = _near(from_, to, one_end, other_end, limit)
    low, high = _within(from_[actions], to[actions], one_end[things], other_end[things], limit)
    hit = (low < high) | ((actions < count) & (low <= high))
    actions, things = actions[hit], things[hit]
    begins = np.searchsorted(actions, np.arange(len(from_) + 1))
    return Conflicts(
        begins.astype(np.intp),
        things.astype(np.intp),
        np.ascontiguousarray(np.column_stack([low, high])[hit]),
    )


def _near(
    from_: Array, to: Array, one_end: Array, other_end: Array, limit: float
) -> tuple[Indices, Indices]:
    """Return which two segments may be nearer than `limit`, ordered by the first."""
    half = np.hypot(*(to - from_).T) / 2
    length = np.hypot(*(other_end - one_end).T) / 2
    tree = spatial.cKDTree((one_end + other_end) / 2)
    found = tree.query_ball_point((from_ + to) / 2, half + length.max() + limit)
    counts = np.fromiter((len(near) for near in found), np.intp, len(found))
    actions: Indices = np.repeat(np.arange(len(found)), counts)
    things = np.fromiter((k for near in found for k in sorted(near)), np.intp, counts.sum())
    return actions, things


def _within(
    from_: Array, to: Array, one_end: Array, other_end: Array, limit: float
) -> tuple[Array, Array]:
    """Return the fractions of segments between which they are nearer than `limit` to others.

    What is that near to a segment is two discs around its ends and a rectangle between them. It is
    convex, so one span of fractions holds all of it; where there is none, the first is the greater.
    """
    low, high = _in_disc(from_, to, one_end, limit)
    for other in (
        _in_disc(from_, to, other_end, limit),
        _beside(from_, to, one_end, other_end, limit),
    ):
        some = other[0] <= other[1]
        low = np.where(some, np.minimum(low, other[0]), low)
        high = np.where(some, np.maximum(high, other[1]), high)
    return low, high


def _in_disc(from_: Array, to: Array, centre: Array, limit: float) -> tuple[Array, Array]:
    """Return the fractions of segments that are in discs; 2 and -1 where nothing is."""
    along, off = to - from_, from_ - centre
    a = (along * along).sum(axis=1)
    b = (along * off).sum(axis=1)
    c = (off * off).sum(axis=1) - limit * limit
    root = b * b - a * c
    point = a <= TINY * TINY
    some = np.where(point, c < 0, root > 0)
    reach = np.sqrt(np.maximum(root, 0.0))
    length = np.where(point, 1.0, a)
    low = np.where(point, 0.0, (-b - reach) / length)
    high = np.where(point, 1.0, (-b + reach) / length)
    return _clipped(low, high, some)


def _beside(
    from_: Array, to: Array, one_end: Array, other_end: Array, limit: float
) -> tuple[Array, Array]:
    """Return the fractions of segments that are in the rectangles along others."""
    axis = other_end - one_end
    length = np.hypot(axis[:, 0], axis[:, 1])
    unit = axis / np.maximum(length, TINY)[:, None]
    normal = np.column_stack([-unit[:, 1], unit[:, 0]])
    low, high = np.zeros(len(axis)), np.ones(len(axis))
    some = length > TINY
    bounds = ((unit, np.zeros(len(axis)), length), (normal, -limit, limit))
    for direction, least, most in bounds:
        at = ((from_ - one_end) * direction).sum(axis=1)
        rate = ((to - from_) * direction).sum(axis=1)
        level = np.abs(rate) <= TINY
        some = some & (~level | ((at > least) & (at < most)))
        divisor = np.where(level, 1.0, rate)
        ends = np.sort(np.column_stack([(least - at) / divisor, (most - at) / divisor]), axis=1)
        low = np.where(level, low, np.maximum(low, ends[:, 0]))
        high = np.where(level, high, np.minimum(high, ends[:, 1]))
    return _clipped(low, high, some)


def _clipped(low: Array, high: Array, some: Array) -> tuple[Array, Array]:
    """Return spans within 0..1; 2 and -1 where there is none."""
    low, high = np.maximum(low, 0.0), np.minimum(high, 1.0)
    some = some & (low <= high)
    return np.where(some, low, 2.0), np.where(some, high, -1.0)
