# SPDX-License-Identifier: BSD-3-Clause
"""Solves the classical problem step by step where robots are so dense that no order of them works.

The search goes from one configuration of all robots to the next (Okumura, LaCAM: Search-Based
Algorithm for Quick Multi-Agent Pathfinding, AAAI 2023). PIBT makes the next one: each robot goes
where it gets nearest to its goal, and a robot in its way goes aside first (Okumura et al.,
Artificial Intelligence 310, 2022). Where PIBT goes in circles, the search fixes steps of
some robots, more and more of them.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hive_common.compiled import compiled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_common.geometry import Array, Indices

CONFIGURATIONS = 5_000  # most that are looked at
MOST = 32  # most lanes from a place, and standing


@dataclass
class _Node:
    """A configuration, and which steps of which robots were not tried from it yet."""

    at: Indices
    before: _Node | None
    ranks: Array
    order: list[int]
    fixed: deque[tuple[tuple[int, int], ...]] = field(default_factory=lambda: deque([()]))


def solve(
    begins: Indices, to: Indices, starts: Sequence[int], goals: Sequence[int], times: Array
) -> list[Indices] | None:
    """Return where all robots are step by step until all are at their goals, or None.

    Args:
        begins: (n + 1,) the lanes from place i are `to[begins[i]:begins[i + 1]]`.
        to: (m,) where each lane ends.
        starts: Where each robot is.
        goals: The goal of each.
        times: (robots, n) how far each place is from each robot's goal.
    """
    draw = np.random.default_rng(len(starts))
    ends = np.array(goals, dtype=np.intp)
    first = np.array(starts, dtype=np.intp)
    far = times[np.arange(len(first)), first] / len(to)
    node = _node(first, None, far, ends)
    seen = {first.tobytes(): node}
    stack = [node]
    for _ in range(CONFIGURATIONS):
        if not stack:
            return None
        node = stack[-1]
        if np.array_equal(node.at, ends):
            return _trail(node)
        if not node.fixed:
            stack.pop()
            continue
        steps = node.fixed.popleft()
        if len(steps) < len(first):
            robot = node.order[len(steps)]
            place = int(node.at[robot])
            choices = [place, *to[begins[place] : begins[place + 1]].tolist()]
            for k in draw.permutation(len(choices)):
                node.fixed.append((*steps, (robot, int(choices[k]))))
        after = _next(node, steps, begins, to, times, draw.random((len(first), MOST)))
        if after is None:
            continue
        known = seen.get(after.tobytes())
        if known is None:
            known = _node(after, node, node.ranks, ends)
            seen[after.tobytes()] = known
        stack.append(known)
    return None


def _node(at: Indices, before: _Node | None, ranks: Array, goals: Indices) -> _Node:
    """Return a configuration; who is not at its goal goes the earlier the longer it is not."""
    ranks = ranks if before is None else np.where(at == goals, ranks - np.floor(ranks), ranks + 1)
    order = np.argsort(-ranks, kind="stable").tolist()
    return _Node(at, before, ranks, order)


def _trail(node: _Node | None) -> list[Indices]:
    """Return the configurations up to one."""
    found = []
    while node is not None:
        found.append(node.at)
        node = node.before
    return found[::-1]


def _next(
    node: _Node,
    steps: tuple[tuple[int, int], ...],
    begins: Indices,
    to: Indices,
    times: Array,
    draws: Array,
) -> Indices | None:
    """Return the configuration after one with some steps fixed, or None if there is none."""
    after = np.full(len(node.at), -1, dtype=np.intp)
    here = np.full(len(begins) - 1, -1, dtype=np.intp)
    there = here.copy()
    here[node.at] = np.arange(len(node.at))
    for robot, place in steps:
        other = here[place]
        swaps = other >= 0 and other != robot and after[other] == node.at[robot]
        if there[place] >= 0 or swaps:
            return None
        after[robot] = place
        there[place] = robot
    order = np.array(node.order, dtype=np.intp)
    if all_step(order, node.at, after, here, there, begins, to, times, draws):
        return after
    return None


@compiled(
    "boolean(int64, int64[::1], int64[::1], int64[::1], int64[::1], int64[::1], int64[::1],"
    " float64[:, ::1], float64[:, ::1])"
)
def step(
    robot: int,
    at: Indices,
    after: Indices,
    here: Indices,
    there: Indices,
    begins: Indices,
    to: Indices,
    times: Array,
    draws: Array,
) -> bool:
    """Choose where a robot goes, and first who is in its way; return whether it can go anywhere.

    Args:
        robot: Its number.
        at: Where each robot is.
        after: Where each goes, -1 if that is open.
        here: Who is at each place, -1 for nobody.
        there: Who goes to each place, -1 for nobody.
        begins: See `solve`.
        to: See there.
        times: See there.
        draws: (robots, lanes) numbers that decide between places equally far from the goal.
    """
    place = at[robot]
    count = begins[place + 1] - begins[place] + 1
    choices = np.empty(count, dtype=np.int64)
    keys = np.empty(count)
    for k in range(count):
        choices[k] = place if k == count - 1 else to[begins[place] + k]
        # Of equal ones, a place where nobody is.
        taken = here[choices[k]] >= 0 and here[choices[k]] != robot
        keys[k] = times[robot, choices[k]] + 0.4 * draws[robot, k] + (0.5 if taken else 0.0)
    for k in np.argsort(keys):
        goal = choices[k]
        other = here[goal]
        if there[goal] >= 0 or (other >= 0 and other != robot and after[other] == place):
            continue
        after[robot] = goal
        there[goal] = robot
        if (
            other < 0
            or other == robot
            or after[other] >= 0
            or step(other, at, after, here, there, begins, to, times, draws)
        ):
            return True
    after[robot] = place
    there[place] = robot
    return False


@compiled(
    "boolean(int64[::1], int64[::1], int64[::1], int64[::1], int64[::1], int64[::1], int64[::1],"
    " float64[:, ::1], float64[:, ::1])"
)
def all_step(
    order: Indices,
    at: Indices,
    after: Indices,
    here: Indices,
    there: Indices,
    begins: Indices,
    to: Indices,
    times: Array,
    draws: Array,
) -> bool:
    """Choose where all robots go; return whether they can. See `step`."""
    for robot in order:
        if after[robot] < 0 and not step(robot, at, after, here, there, begins, to, times, draws):
            return False
    return True
