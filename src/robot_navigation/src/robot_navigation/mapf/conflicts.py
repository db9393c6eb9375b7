# SPDX-License-Identifier: BSD-3-Clause
"""What a robot blocks for another one, at each place and along each lane of a roadmap.

Places and ways are what robots reserve. A way is a lane or its reverse lane; way k has the number
n + k, behind the n places. A robot that stands blocks every place and way that is nearer to it
than both radii and the gap; one that drives along a lane blocks for the whole drive what is that
near to any part of it. So no two drives that could touch overlap in time, and that is what
an order of robots at places can ensure (`dependency_graph.py`).
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
    """

    begins: Indices
    blocked: Indices


def ways(roadmap: Roadmap) -> Indices:
    """Return the number of each lane's way, (m,), from 0; a lane shares it with its reverse."""
    pairs = np.sort(roadmap.lanes, axis=1)
    keys = pairs[:, 0] * len(roadmap.places) + pairs[:, 1]
    numbers: Indices = np.unique(keys, return_inverse=True)[1].astype(np.intp)
    return numbers


def classical_conflicts(roadmap: Roadmap) -> Conflicts:
    """Return the conflicts of the classical problem: no two robots at a place, none swap places.

    A robot may drive to a place while another one leaves it (Stern et al., Multi-Agent
    Pathfinding: Definitions, Variants, and Benchmarks, SoCS 2019).
    """
    count, lanes = len(roadmap.places), len(roadmap.lanes)
    blocked = np.column_stack([roadmap.lanes[:, 1], count + ways(roadmap)]).reshape(-1)
    begins = np.concatenate([np.arange(count), count + 2 * np.arange(lanes + 1)])
    everything = np.concatenate([np.arange(count), blocked])
    return Conflicts(begins.astype(np.intp), everything.astype(np.intp))


def spatial_conflicts(roadmap: Roadmap, apart: float) -> Conflicts:
    """Return what robots block that must stay `apart` from each other, centre to centre [m]."""
    limit = max(apart - TINY, 0.0)
    number = ways(roadmap)
    first = np.unique(number, return_index=True)[1]
    begin, end = roadmap.places[roadmap.lanes[:, 0]], roadmap.places[roadmap.lanes[:, 1]]
    # A place is a lane of no length, so one calculation does for both.
    from_ = np.vstack([roadmap.places, begin])
    to = np.vstack([roadmap.places, end])
    one_end = np.vstack([roadmap.places, begin[first]])
    other_end = np.vstack([roadmap.places, end[first]])
    actions, things = _near(from_, to, one_end, other_end, limit)
    hit = _apart(from_[actions], to[actions], one_end[things], other_end[things]) < limit
    actions, things = actions[hit], things[hit]
    begins = np.searchsorted(actions, np.arange(len(from_) + 1))
    return Conflicts(begins.astype(np.intp), things.astype(np.intp))


def _near(
    from_: Array, to: Array, one_end: Array, other_end: Array, limit: float
) -> tuple[Indices, Indices]:
    """Return which two segments may be nearer than `limit`, ordered by the first."""
    half = np.hypot(*(to - from_).T) / 2
    length = np.hypot(*(other_end - one_end).T) / 2
    tree = spatial.cKDTree((one_end + other_end) / 2)
    found = tree.query_ball_point(
        (from_ + to) / 2, half + length.max(initial=0.0) + limit, return_sorted=True
    )
    counts = np.fromiter((len(near) for near in found), np.intp, len(found))
    actions: Indices = np.repeat(np.arange(len(found)), counts)
    things: Indices = np.concatenate([np.asarray(near, dtype=np.intp) for near in found])
    return actions, things


def _apart(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return the distances of segments ab from segments cd [m], (k,)."""
    ends = ((a, c, d), (b, c, d), (c, a, b), (d, a, b))
    least: Array = np.min([_to_segment(*three) for three in ends], axis=0)
    crossing = (_side(a, b, c) * _side(a, b, d) < 0) & (_side(c, d, a) * _side(c, d, b) < 0)
    return np.where(crossing, 0.0, least)


def _to_segment(point: Array, begin: Array, end: Array) -> Array:
    """Return the distances of points from segments [m], (k,)."""
    along = end - begin
    squared = (along * along).sum(axis=1)
    share = ((point - begin) * along).sum(axis=1) / np.where(squared > 0, squared, 1.0)
    off = point - begin - np.clip(share, 0.0, 1.0)[:, None] * along
    distance: Array = np.hypot(off[:, 0], off[:, 1])
    return distance


def _side(begin: Array, end: Array, point: Array) -> Array:
    """Return on which side of lines points are: positive on the left, (k,)."""
    along, off = end - begin, point - begin
    side: Array = along[:, 0] * off[:, 1] - along[:, 1] * off[:, 0]
    return side
