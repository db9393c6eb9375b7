# SPDX-License-Identifier: BSD-3-Clause
"""Distance fields in compiled code, for the process beside the leader.

They are those of `costing.grid_path_lengths`, several times as fast. numba would take a robot's
process, or the leader's, 70 MB of memory.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from blackboard.domain.path_lengths import Field, FieldJob, Floats

    Nodes = NDArray[np.int32]

MOVE_TIME = 4e-9
"""Processor time that a move takes for each field [s], with the way back to the leader."""

_MOST_BUCKETS = 1_000_000


def fields(job: FieldJob) -> Iterator[Field]:
    """Yield the fields that are wanted."""
    is_free = job.moves.costs is job.moves.lengths
    for goal in job.goals:
        lengths, lost = _field(*job.moves, goal)
        yield lengths, None if is_free else lost


def time_for(job: FieldJob) -> float:
    """Return the processor time of a job, as it is counted [s]."""
    return MOVE_TIME * len(job.moves.costs) * len(job.goals)


@compiled()
def _put(before: NDArray[np.int32], behind: NDArray[np.int32], node: int, place: int) -> None:
    """Take a node out of its ring, and put it before another one, or into a ring of its own."""
    behind[before[node]] = behind[node]
    before[behind[node]] = before[node]
    before[node] = behind[node] = node
    if place != node:
        before[node], behind[node] = before[place], place
        behind[before[node]] = before[place] = node


@compiled(
    "Tuple((float64[::1],float64[::1]))(int32[::1],int32[::1],float64[::1],float64[::1],int64)"
)
def _field(
    first: Nodes, starts: Nodes, costs: Floats, lengths: Floats, goal: int
) -> tuple[Floats, Floats]:
    """Return how long the paths from all nodes to a goal are, and how much more they cost [m].

    This is Dijkstra's algorithm with nodes in buckets of about the same cost (R. Dial, "Algorithm
    360", Communications of the ACM 12, 1969). A node whose cost falls after its turn gets another
    one, so the width of the buckets changes no result.
    """
    nodes = len(first) - 1
    cost, length = np.full(nodes, np.inf), np.full(nodes, np.inf)
    cost[goal] = length[goal] = 0.0
    least, most = (costs.min(), costs.max()) if len(costs) else (1.0, 1.0)
    width = max(least, most / _MOST_BUCKETS)
    buckets = int(most / width) + 2
    # Each bucket is a ring of its nodes and of a number behind those of all nodes, which is its
    # end. A node that waits for no turn is a ring of its own.
    before = np.arange(nodes + buckets).astype(np.int32)
    behind = before.copy()
    _put(before, behind, goal, nodes)
    at = empty = 0
    while empty < buckets:
        here = behind[nodes + at]
        if here >= nodes:
            at, empty = (at + 1) % buckets, empty + 1
            continue
        empty = 0
        _put(before, behind, here, here)
        for move in range(first[here], first[here + 1]):
            there, reached = starts[move], cost[here] + costs[move]
            if reached < cost[there]:
                cost[there], length[there] = reached, length[here] + lengths[move]
                _put(before, behind, there, nodes + int(reached / width) % buckets)
    for node in range(nodes):
        cost[node] = max(0.0, cost[node] - length[node]) if cost[node] < np.inf else 0.0
    return length, cost
