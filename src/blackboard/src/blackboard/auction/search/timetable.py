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

    from blackboard.auction.search.problem import Floats, Numbers, Problem


class Totals(Protocol):
    """Totals of lists, in arrays with one number for each."""

    @property
    def energy(self) -> Floats:
        """For driving and working [J]."""

    @property
    def finish(self) -> Floats:
        """Time until all is done [s]."""

    @property
    def waiting(self) -> Floats:
        """Sum of weight times the time until each task is done [s]."""


class Book:
    """The figures of a problem in the form in which timetables look them up.

    Attributes:
        alike: Whether all robots are of one kind.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.nothing = problem.nothing
        self.width = problem.nothing + 1
        self.alike = problem.leg.shape[0] == 1
        self._size = problem.leg[0].size
        self._legs = np.ascontiguousarray(problem.leg).ravel()
        self._leg_draws = np.ascontiguousarray(problem.leg_draw).ravel()
        self._own, self._own_draw = problem.own.ravel(), problem.own_draw.ravel()
        self.weight = np.append(problem.weight, 0.0)
        nothing = np.zeros((problem.robots, 1), dtype=bool)
        self.able = np.hstack([problem.able, ~nothing])
        # Below any priority, so that the end of a list admits every task.
        self.priority = np.append(problem.priority, -1)
        self.has_order = bool(np.ptp(problem.priority)) if self.nothing else False
        self.all_able = bool(problem.able.all())
        self.has_limits = bool(np.isfinite(problem.most).any())

    def leg(self, robot: Numbers, here: Numbers, there: Numbers) -> Floats:
        """Return times [s] from the ends of nodes to the beginnings of tasks, broadcast."""
        return self._legs.take(self._index(robot, here, there))

    def leg_draw(self, robot: Numbers, here: Numbers, there: Numbers) -> Floats:
        """Return energies [J] from the ends of nodes to the beginnings of tasks, broadcast."""
        return self._leg_draws.take(self._index(robot, here, there))

    def own(self, robot: Numbers, task: Numbers) -> Floats:
        """Return the times of tasks from their beginnings on [s], broadcast."""
        return self._own.take(self._own_index(robot, task))

    def own_draw(self, robot: Numbers, task: Numbers) -> Floats:
        """Return the energies of tasks from their beginnings on [J], broadcast."""
        return self._own_draw.take(self._own_index(robot, task))

    def node(self, robot: Numbers) -> Numbers:
        """Return the nodes where robots become free."""
        return robot + self.width

    def _index(self, robot: Numbers, here: Numbers, there: Numbers) -> Numbers:
        index = here * self.width + there
        return index if self.alike else index + self.problem.kind[robot] * self._size

    def _own_index(self, robot: Numbers, task: Numbers) -> Numbers:
        return task if self.alike else task + self.problem.kind[robot] * self.width


@dataclass(frozen=True)
class Bundles:
    """Tasks that are inserted as a whole.

    Attributes:
        tasks: (..., longest) of each bundle in their order, then `nothing`.
        size: (...) number of tasks.
        first: (...) the first of them.
        last: (...) the last of them.
        weight: (...) sum of the weights.
    """

    tasks: Numbers
    size: Numbers
    first: Numbers
    last: Numbers
    weight: Floats


def make_bundles(book: Book, tasks: Numbers) -> Bundles:
    """Return bundles of tasks; see `Bundles.tasks`."""
    first = tasks[..., 0]
    size = (tasks != book.nothing).sum(axis=-1)
    last = np.take_along_axis(tasks, np.maximum(size - 1, 0)[..., None], axis=-1)[..., 0]
    return Bundles(tasks, size, first, last, book.weight[tasks].sum(axis=-1))


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
        self.leg = book.leg(robot[..., None], self.before, self.after)

    @cached_property
    def lengths(self) -> Numbers:
        """(...) number of tasks in each list."""
        found: Numbers = (self.order != self.book.nothing).sum(axis=-1)
        return found

    @cached_property
    def done(self) -> Floats:
        """(..., places + 1) time [s] at which the robot is free before each place."""
        done = np.empty_like(self.leg)
        done[..., 0] = self.book.problem.ready[self.robot]
        times = self.leg[..., :-1] + self.book.own(self.robot[..., None], self.order)
        np.cumsum(times, axis=-1, out=done[..., 1:])
        done[..., 1:] += done[..., :1]
        return done

    @cached_property
    def weight_behind(self) -> Floats:
        """(..., places + 1) weight of all tasks from each place on."""
        weights = self.book.weight[self.after]
        return weights[..., ::-1].cumsum(axis=-1)[..., ::-1]

    @cached_property
    def leg_draw(self) -> Floats:
        """(..., places + 1) energy of the drive to each place [J]."""
        return self.book.leg_draw(self.robot[..., None], self.before, self.after)

    @property
    def energy(self) -> Floats:
        """See `Totals`."""
        own = self.book.own_draw(self.robot[..., None], self.order)
        energy: Floats = self.leg_draw.sum(axis=-1) + own.sum(axis=-1)
        return energy

    @property
    def finish(self) -> Floats:
        """See `Totals`."""
        return self.done[..., -1]

    @property
    def waiting(self) -> Floats:
        """See `Totals`."""
        waiting: Floats = (self.done[..., 1:] * self.book.weight[self.order]).sum(axis=-1)
        return waiting


class Insertions:
    """Lists, shaped (..., lists), with one more bundle of those shaped (..., bundles).

    They are `Totals` shaped (..., bundles, lists, places + 1).
    """

    def __init__(self, table: Timetable, bundles: Bundles) -> None:
        self._table = table
        self._bundles = bundles
        self._robot = table.robot[..., None, :, None]
        self._first = bundles.first[..., :, None, None]
        self._last = bundles.last[..., :, None, None]
        self._before = table.before[..., None, :, :]
        self._after = table.after[..., None, :, :]

    @cached_property
    def _go(self) -> Floats:
        return self._table.book.leg(self._robot, self._before, self._first)

    @cached_property
    def _parts(self) -> tuple[Floats, Floats]:
        """What each task of a bundle takes with the drive before it [s], and its weight.

        Both (..., bundles, lists or 1, longest); the first task comes without a drive.
        """
        book, tasks = self._table.book, self._bundles.tasks[..., :, None, :]
        robot = self._robot[..., :1, :] if book.alike else self._robot
        taken = book.own(robot, tasks)
        if tasks.shape[-1] > 1:
            taken[..., 1:] += book.leg(robot, tasks[..., :-1], tasks[..., 1:])
        return taken, book.weight[tasks]

    @cached_property
    def added_time(self) -> Floats:
        """Delay of the end [s]."""
        book = self._table.book
        back = book.leg(self._robot, self._last, self._after)
        own = self._parts[0].sum(axis=-1)[..., None]
        added: Floats = self._go + back - self._table.leg[..., None, :, :] + own
        return added

    @property
    def energy(self) -> Floats:
        """See `Totals`."""
        table, book, tasks = self._table, self._table.book, self._bundles.tasks[..., :, None, :]
        own = book.own_draw(self._robot, tasks).sum(axis=-1)
        if tasks.shape[-1] > 1:
            own += book.leg_draw(self._robot, tasks[..., :-1], tasks[..., 1:]).sum(axis=-1)
        go = book.leg_draw(self._robot, self._before, self._first)
        back = book.leg_draw(self._robot, self._last, self._after)
        added = go + back - table.leg_draw[..., None, :, :] + own[..., None]
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
        arrival = table.done[..., None, :, :] + self._go
        taken, weight = self._parts
        within = (weight * taken.cumsum(axis=-1)).sum(axis=-1)[..., None]
        own = bundles.weight[..., :, None, None] * arrival + within
        behind = self.added_time * table.weight_behind[..., None, :, :]
        total: Floats = table.waiting[..., None, :, None] + own + behind
        return total

    def refused(self) -> NDArray[np.bool_]:
        """Return where a bundle may not go.

        That is past the end, out of order, with a robot that cannot do it, or where the robot
        would be at work for too long.
        """
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
        if book.has_limits:
            late = self.finish > book.problem.most[table.robot][..., None, :, None]
            refused = refused | (late & ~empty)
        everywhere: NDArray[np.bool_] = np.broadcast_to(refused, self._go.shape)
        return everywhere
