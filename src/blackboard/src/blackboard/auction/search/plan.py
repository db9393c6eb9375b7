# SPDX-License-Identifier: BSD-3-Clause
"""Plans: a list of tasks for each robot, also in the form of one array."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blackboard.auction.search.problem import Numbers
    from blackboard.auction.search.timetable import Bundles

Plan = tuple[tuple[int, ...], ...]  # the tasks of each robot in their order


def to_order(plan: Sequence[Sequence[int]], nothing: int) -> Numbers:
    """Return a plan as an array (robots, places) with at least one spare place at the end."""
    most = max(map(len, plan), default=0)
    order = np.full((len(plan), most + 1), nothing)
    for row, tasks in zip(order, plan, strict=True):
        row[: len(tasks)] = tasks
    return order


def to_plan(order: Numbers, nothing: int) -> Plan:
    """Return the plan that an array (robots, places) holds."""
    return tuple(tuple(int(task) for task in row if task != nothing) for row in order)


def without(order: Numbers, start: Numbers, size: Numbers, nothing: int) -> Numbers:
    """Return lists without a bundle each.

    Args:
        order: (..., places) lists.
        start: (...) place of the first task to take out.
        size: (...) number of tasks to take out.
        nothing: Fills the places after the last task.
    """
    places = np.arange(order.shape[-1])
    source = places + np.where(places < start[..., None], 0, size[..., None])
    padded = np.concatenate([order, np.full((*order.shape[:-1], 1), nothing)], axis=-1)
    source = np.minimum(source, order.shape[-1])
    return np.take_along_axis(padded, source, axis=-1)


def cut_out(order: Numbers, start: Numbers, size: Numbers, nothing: int) -> Numbers:
    """Return the bundles that `without` takes out, shaped (..., longest)."""
    places = np.arange(max(1, int(size.max())))
    source = np.minimum(start[..., None] + places, order.shape[-1] - 1)
    taken = np.take_along_axis(order, source, axis=-1)
    return np.where(places < size[..., None], taken, nothing)


def put_in(order: Numbers, place: Numbers, bundles: Bundles, nothing: int) -> Numbers:
    """Return lists with a bundle inserted into each.

    Args:
        order: (..., places) lists.
        place: (...) where the bundle's first task goes.
        bundles: (...) one for each list.
        nothing: Fills the places after the last task.
    """
    width = order.shape[-1] + bundles.tasks.shape[-1]
    places = np.arange(width)
    place, size = place[..., None], bundles.size[..., None]
    source = np.where(places < place, places, places - size)
    kept = np.take_along_axis(order, np.clip(source, 0, order.shape[-1] - 1), axis=-1)
    kept = np.where(source < order.shape[-1], kept, nothing)
    within = np.clip(places - place, 0, bundles.tasks.shape[-1] - 1)
    added = np.take_along_axis(bundles.tasks, within, axis=-1)
    return np.where((places >= place) & (places < place + size), added, kept)


def narrow(order: Numbers, nothing: int) -> Numbers:
    """Return lists without unused places, except one."""
    most = int((order != nothing).sum(axis=-1).max(initial=0))
    return np.ascontiguousarray(order[..., : most + 1])
