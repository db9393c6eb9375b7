# SPDX-License-Identifier: BSD-3-Clause
"""A roadmap and its ends as one graph, to look for paths on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hive_navigation.mapf.ends import joined_ends

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices
    from hive_navigation.mapf.roadmap import Roadmap
    from hive_navigation.planning.clearance import ClearanceField


class Joined(NamedTuple):
    """A roadmap whose places and lanes include ends and legs; see `Roadmap`."""

    places: Array
    lanes: Indices
    begins: Indices
    lengths: Array
    widths: Array
    speeds: Array


def with_ends(
    roadmap: Roadmap,
    field: ClearanceField,
    points: Array,
    radii: Array,
    direct: Sequence[tuple[int, int]] = (),
) -> tuple[Joined, Indices]:
    """Return a roadmap together with its ends, and the places of the points.

    See `joined_ends` for the arguments; legs lead in both directions.
    """
    ends = joined_ends(roadmap, field, points, radii, direct)
    lanes = np.concatenate([roadmap.lanes, ends.legs])
    order = np.argsort(lanes[:, 0], kind="stable")
    places = np.concatenate([roadmap.places, ends.points])
    joined = Joined(
        places,
        lanes[order],
        np.searchsorted(lanes[order, 0], np.arange(len(places) + 1)),
        *(
            np.concatenate([getattr(roadmap, name), getattr(ends, name)])[order]
            for name in ("lengths", "widths", "speeds")
        ),
    )
    return joined, ends.index
