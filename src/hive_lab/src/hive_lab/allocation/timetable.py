# SPDX-License-Identifier: BSD-3-Clause
"""The cost of many robots' lists, and their cost with one more bundle inserted in each.

All lists are rows of one array, so one numpy call answers for every robot, bundle and place at
once. A bundle is one task or several consecutive ones, inserted as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_lab.allocation.instance import Instance

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.int64]


class Totals(Protocol):
    """Totals of lists, in arrays with one number for each."""

    @property
    def energy(self) -> Floats:
        """For driving [J]."""

    @property
    def finish(self) -> Floats:
        """Time until all is done [s]."""

    @property
    def waiting(self) -> Floats:
        """Sum of weight times the time until each task is done [s]."""

    @property
    def toil(self) -> Floats:
        """Sum of place in the list, from 1, times path length [m]."""


class Book:
    """The figures of an instance in the form in which timetables look them up."""

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        self.nothing = instance.nothing
        self.width = instance.nothing + 1
        self._flat = np.ascontiguousarray(instance.table).ravel()
        self.inner = instance.column("inner")
        self.work = instance.column("work")
        self.weight = instance.column("weight")
        robots = np.zeros((len(instance.robots), 1), dtype=bool)
        self.able = np.hstack([instance.able, ~robots])
        # Below any priority, so that the end of a list admits every task.
        self.priority = np.append(instance.tasks.priority, -1)
        self.has_order = bool(np.ptp(instance.tasks.priority)) if self.nothing else False
        self.all_able = bool(instance.able.all())

    def way(self, here: Numbers, there: Numbers) -> Floats:
        """Return path lengths [m] from the ends of nodes to the starts of tasks, broadcast."""
        return self._flat.take(here * self.width + there)

    def node(self, robot: Numbers) -> Numbers:
        """Return the nodes where robots become free."""
        return robot + self.width


@dataclass(frozen=True)
class Bundles:
    """Tasks that are inserted as a whole.

    Attributes:
        tasks: (..., longest) of each bundle in their order, then `nothing`.
        size: (...) number of tasks.
        first: (...) the first of them.
        last: (...) the last of them.
        way: (...) from the start of the first to the end of the last [m].
        work: (...) time beside driving [s].
        weight: (...) sum of the weights.
        wait_way: (...) sum of weight times path from the first start until each is done [m].
        wait_work: (...) sum of weight times time beside driving until each is done [s].
        toil: (...) sum of place times path, with the first at place 0 [m].
    """

    tasks: Numbers
    size: Numbers
    first: Numbers
    last: Numbers
    way: Floats
    work: Floats
    weight: Floats
    wait_way: Floats
    wait_work: Floats
    toil: Floats


def make_bundles(book: Book, tasks: Numbers) -> Bundles:
    """Compute the figures of bundles; see `Bundles.tasks`."""
    first = tasks[..., 0]
    weight = book.weight[tasks]
    inner, work = book.inner[tasks], book.work[tasks]
    if tasks.shape[-1] == 1:
        inner, work, weight = inner[..., 0], work[..., 0], weight[..., 0]
        none = np.zeros_like(inner)
        size = (first != book.nothing).astype(int)
        waits = weight * inner, weight * work
        return Bundles(tasks, size, first, first, inner, work, weight, *waits, none)
    size = (tasks != book.nothing).sum(axis=-1)
    last = np.take_along_axis(tasks, np.maximum(size - 1, 0)[..., None], axis=-1)[..., 0]
    ways = inner.copy()
    ways[..., 1:] += book.way(tasks[..., :-1], tasks[..., 1:])
    way_until, work_until = ways.cumsum(axis=-1), work.cumsum(axis=-1)
    places = np.arange(tasks.shape[-1])
    return Bundles(
        tasks,
        size,
        first,
        last,
        way=way_until[..., -1],
        work=work_until[..., -1],
        weight=weight.sum(axis=-1),
        wait_way=(weight * way_until).sum(axis=-1),
        wait_work=(weight * work_until).sum(axis=-1),
        toil=(places * ways).sum(axis=-1),
    )


class Timetable:
    """Lists, as `Totals` with one number for each.

    Args:
        robot: (...) owner of each list.
        order: (..., places) tasks of each list, then `nothing`.
    """

    def __init__(self, book: Book, robot: Numbers, order: Numbers) -> None:
        self.book = book
        self.robot = robot
        self.order = order
        shape = order.shape[:-1]
        self.before = np.empty((*shape, order.shape[-1] + 1), dtype=order.dtype)
        self.before[..., 0], self.before[..., 1:] = book.node(robot), order
        self.after = np.full_like(self.before, book.nothing)
        self.after[..., :-1] = order
        self.leg = book.way(self.before, self.after)
        self.speed = book.instance.robots.speed[robot]
        self.own = self.leg + book.inner[self.after]

    @cached_property
    def lengths(self) -> Numbers:
        """(...) number of tasks in each list."""
        found: Numbers = (self.order != self.book.nothing).sum(axis=-1)
        return found

    @cached_property
    def done(self) -> Floats:
        """(..., places + 1) time [s] at which the robot is free before each place."""
        done = np.empty_like(self.leg)
        done[..., 0] = self.book.instance.robots.ready[self.robot]
        times = self.own[..., :-1] / self.speed[..., None] + self.book.work[self.order]
        np.cumsum(times, axis=-1, out=done[..., 1:])
        done[..., 1:] += done[..., :1]
        return done

    @cached_property
    def weight_behind(self) -> Floats:
        """(..., places + 1) weight of all tasks from each place on."""
        weights = self.book.weight[self.after]
        return weights[..., ::-1].cumsum(axis=-1)[..., ::-1]

    @cached_property
    def own_behind(self) -> Floats:
        """(..., places + 1) path length of all tasks from each place on [m]."""
        return self.own[..., ::-1].cumsum(axis=-1)[..., ::-1]

    @property
    def way(self) -> Floats:
        """(...) path length [m]."""
        way: Floats = self.own.sum(axis=-1)
        return way

    @property
    def energy(self) -> Floats:
        """See `Totals`."""
        return self.way * self.book.instance.robots.draw[self.robot]

    @property
    def finish(self) -> Floats:
        """See `Totals`."""
        return self.done[..., -1]

    @property
    def waiting(self) -> Floats:
        """See `Totals`."""
        waiting: Floats = (self.done[..., 1:] * self.book.weight[self.order]).sum(axis=-1)
        return waiting

    @property
    def toil(self) -> Floats:
        """See `Totals`."""
        toil: Floats = (self.own * np.arange(1, self.own.shape[-1] + 1)).sum(axis=-1)
        return toil


class Insertions:
    """Lists, shaped (..., lists), with one more bundle of those shaped (..., bundles).

    They are `Totals` shaped (..., bundles, lists, places + 1).
    """

    def __init__(self, table: Timetable, bundles: Bundles) -> None:
        self._table = table
        self._bundles = bundles
        book = table.book
        first = bundles.first[..., :, None, None]
        last = bundles.last[..., :, None, None]
        self._go = book.way(table.before[..., None, :, :], first)
        self._back = book.way(last, table.after[..., None, :, :])
        self._leg = table.leg[..., None, :, :]
        self._speed = table.speed[..., None, :, None]

    @cached_property
    def added_way(self) -> Floats:
        """Added path length [m]."""
        added: Floats = self._go + self._back - self._leg + self._bundles.way[..., :, None, None]
        return added

    @cached_property
    def added_time(self) -> Floats:
        """Delay of the end [s]."""
        added: Floats = self.added_way / self._speed + self._bundles.work[..., :, None, None]
        return added

    @property
    def energy(self) -> Floats:
        """See `Totals`."""
        table = self._table
        draw = table.book.instance.robots.draw[table.robot]
        added = self.added_way * draw[..., None, :, None]
        total: Floats = table.energy[..., None, :, None] + added
        return total

    @property
    def finish(self) -> Floats:
        """See `Totals`."""
        total: Floats = self._table.finish[..., None, :, None] + self.added_time
        return total

    @property
    def waiting(self) -> Floats:
        """See `Totals`."""
        table, bundles = self._table, self._bundles
        arrival = table.done[..., None, :, :] + self._go / self._speed
        own = bundles.weight[..., :, None, None] * arrival
        own += bundles.wait_way[..., :, None, None] / self._speed
        own += bundles.wait_work[..., :, None, None]
        behind = self.added_time * table.weight_behind[..., None, :, :]
        return table.waiting[..., None, :, None] + own + behind

    @property
    def toil(self) -> Floats:
        """See `Totals`."""
        table, bundles = self._table, self._bundles
        places = np.arange(1, table.leg.shape[-1] + 1)
        size = bundles.size[..., :, None, None]
        own = places * (self._go + bundles.way[..., :, None, None])
        behind = size * table.own_behind[..., None, :, :]
        behind = behind + (places + size) * (self._back - self._leg)
        before = table.toil[..., None, :, None] + bundles.toil[..., :, None, None]
        total: Floats = before + own + behind
        return total

    def refused(self) -> NDArray[np.bool_]:
        """Return where a bundle may not go: past the end, out of order, or not for the robot."""
        table, bundles, book = self._table, self._bundles, self._table.book
        places = np.arange(table.leg.shape[-1])
        length = table.lengths[..., None, :, None]
        empty = (bundles.size == 0)[..., :, None, None]
        refused = (places > length) | (empty & (places < length))
        if book.has_order:
            ahead = np.where(places > 0, book.priority[np.minimum(table.before, book.nothing)], 99)
            behind = book.priority[table.after]
            refused = refused | (
                ahead[..., None, :, :] < book.priority[bundles.first][..., None, None]
            )
            refused = refused | (
                behind[..., None, :, :] > book.priority[bundles.last][..., None, None]
            )
        if not book.all_able:
            able = book.able[table.robot[..., None, :, None], bundles.tasks[..., :, None, :]]
            refused = refused | ~able.all(axis=-1)[..., None]
        return np.broadcast_to(refused, self._go.shape)
