# SPDX-License-Identifier: BSD-3-Clause
"""What each task of a plan takes each robot at its best place in the lists, as a bid says it.

The robot that has the task by the plan is asked for the place that the plan gives it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from blackboard.auction.search.problem import Floats, Numbers, Plan, Problem

MOST = 2_000
"""In a plan with more pairs of task and robot, only the best robots of each task are told."""

OFFER_TIME = 5e-7
"""Processor time for one pair of task and robot with lists of up to ten tasks [s]."""


class Offers(NamedTuple):
    """Arrays of (tasks, robots told): first the robot that gets the task, then the best others.

    Attributes:
        robot: Who is asked.
        place: Where the task goes in the planned list, 0 is first; -1 if it goes nowhere.
        before: The node from which the robot drives there; see `Problem`.
        after: The task that follows, or `nothing`.
        eta: Time until the task is done [s].
        finish: Time until the whole list is done [s].
        waiting: How much longer all tasks of the list wait, the task itself included [s].
        drawn: What the planned part of the list draws before [J].
        draw: What the task draws [J].
        added_draw: What the whole list draws more because of it [J].
    """

    robot: Numbers
    place: Numbers
    before: Numbers
    after: Numbers
    eta: Floats
    finish: Floats
    waiting: Floats
    drawn: Floats
    draw: Floats
    added_draw: Floats


def offers_for(problem: Problem, plan: Plan, measure: str) -> Offers:
    """Return what each task takes each robot; `measure` chooses the place.

    `measure` is a name of `domain.settings.MEASURE_NAMES`.
    """
    robots = [_List(problem, robot, row).offers(measure) for robot, row in enumerate(plan)]
    offers = Offers._make(np.stack(tables, axis=1) for tables in zip(*robots, strict=True))
    value = _value(offers, measure)
    for robot, row in enumerate(plan):
        value[list(row), robot] = -np.inf
    count = max(1, min(problem.robots, MOST // max(1, problem.nothing)))
    best = np.argsort(value, axis=1, kind="stable")[:, :count]
    return Offers._make(np.take_along_axis(table, best, axis=1) for table in offers)


def _value(offers: Offers, measure: str) -> Floats:
    """Return what chooses among places and robots; infinite where a task goes nowhere."""
    value = {"waiting": offers.waiting, "makespan": offers.finish, "way": offers.added_draw}
    return np.where(offers.place < 0, np.inf, value[measure])


class _List:
    """One robot's list, to which each task of the plan may be added."""

    def __init__(self, problem: Problem, robot: int, row: Sequence[int]) -> None:
        self._problem, self._robot = problem, robot
        self._row = np.array(row, dtype=np.int64)
        kind = problem.kind[robot]
        self._leg, self._leg_draw = problem.leg[kind], problem.leg_draw[kind]
        self._own, self._own_draw = problem.own[kind, :-1], problem.own_draw[kind, :-1]
        self._nodes = np.append(problem.nothing + 1 + robot, self._row)
        done = [problem.ready[robot], *problem.times(robot, row)]
        self._done = np.array(done)
        draws = self._leg_draw[self._nodes[:-1], self._row] + self._own_draw[self._row]
        self._drawn = np.append(0.0, np.cumsum(draws))
        weights = problem.weight[self._row]
        self._behind = np.append(np.cumsum(weights[::-1])[::-1], 0.0)

    def offers(self, measure: str) -> Offers:
        """Return arrays of (tasks,): each task at its best place, or at the one it has."""
        tasks, count = np.arange(self._problem.nothing), len(self._row)
        places = np.arange(count + 1)[:, np.newaxis]
        after = np.append(self._row, self._problem.nothing)[:, np.newaxis]
        every = self._at(tasks[np.newaxis, :], places, after)
        priority = self._problem.priority
        first = (priority[self._row, np.newaxis] > priority).sum(axis=0)
        last = (priority[self._row, np.newaxis] >= priority).sum(axis=0)
        fits = (places >= first) & (places <= last)
        fits &= every.finish <= self._problem.most[self._robot]
        fits &= self._problem.able[self._robot]
        best = _value(every._replace(place=np.where(fits, 0, -1)), measure).argmin(axis=0)
        chosen = Offers(*(table[best, tasks] for table in every))
        chosen = chosen._replace(place=np.where(fits[best, tasks], best, -1))
        here = np.arange(count)
        following = np.append(self._row[1:], self._problem.nothing) if count else self._row
        held = self._at(self._row, here, following, is_held=True)
        for table, mine in zip(chosen, held, strict=True):
            table[self._row] = mine
        return chosen

    def _at(
        self, tasks: Numbers, places: Numbers, after: Numbers, *, is_held: bool = False
    ) -> Offers:
        """Return what tasks take at places of the list, or what those take that it holds."""
        before = self._nodes[places]
        reach = self._leg[before, tasks] + self._own[tasks]
        added = reach + self._leg[tasks, after] - self._leg[before, after]
        draw = self._leg_draw[before, tasks] + self._own_draw[tasks]
        added_draw = draw + self._leg_draw[tasks, after] - self._leg_draw[before, after]
        eta = self._done[places] + reach
        behind = self._behind[places + is_held]
        finish = self._done[-1] + (0.0 * added if is_held else added)
        waiting = self._problem.weight[tasks] * eta + added * behind
        shape: NDArray[np.int64] = np.zeros(eta.shape, dtype=np.int64)
        return Offers(
            shape + self._robot,
            shape + places,
            shape + before,
            shape + after,
            eta,
            finish,
            waiting,
            self._drawn[places] + 0.0 * eta,
            draw,
            added_draw,
        )
