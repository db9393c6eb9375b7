# SPDX-License-Identifier: BSD-3-Clause
"""Goes on improving the allocation: tasks that have not begun are offered again.

In each step every robot offers a bundle from its schedule, one task or all tasks from some task
on, and every robot bids on each bundle for its schedule without its own. The bundles are allocated
so that the sum of the measure is least, at most one to each robot (the assignment problem). So a
step moves tasks, swaps them, exchanges the ends of schedules (2-opt*), or passes them on in a
ring. `transfers.py` carries out what gains enough: a task is with nobody until its robot has
handed it back, and a robot that has begun keeps it.

The measure is not the bid. The bid says who should get a task, but not with every cost model
whether to take it from the robot that has it: if a robot counts only its own time, for example,
each could again and again be put before all others.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING

import numpy as np

from blackboard.auction.assignment import assignment
from blackboard.auction.transfers import Move
from blackboard.costing.cost import MEASURES
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from blackboard.auction.auction import Bundle
    from blackboard.auction.transfers import Exchange
    from blackboard.domain.bid import Bid, CostTerms
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord

PASSES = 3
"""In one of this many passes through its schedule, a robot only takes."""

PLANS = 2
"""After so many plans that gain nothing, the next waits until something changes."""

PLAN_THRESHOLD = 0.04
"""A plan for the whole fleet is followed for this share of the gain that one exchange needs: what
it changes is a small part of what all lists take."""


@dataclass(frozen=True, slots=True)
class Reallocation:
    """Chooses what is offered, and which of it changes hands.

    Steps follow each other until every robot has offered all of its schedule a few times without
    a gain; then they rest until something changes.
    """

    measure: str  # a name of `MEASURES`
    # Tasks change hands only if the measure falls by more than this share, so that assignments do
    # not flutter.
    threshold: float
    turn: int = 0  # number of the step
    quiet_steps: int = 0  # steps since something changed

    def resume(self) -> Reallocation:
        """Begin to offer again: the allocation may no longer be the best."""
        return replace(self, quiet_steps=0)

    @property
    def may_plan(self) -> bool:
        """Whether another plan may be better: the last ones were, or something has changed."""
        return self.threshold < 1.0 and self.quiet_steps < PLANS

    def planned(self) -> Reallocation:
        """Note that one more plan is made."""
        return replace(self, turn=self.turn + 1, quiet_steps=self.quiet_steps + 1)

    def is_worth(self, gain: float) -> bool:
        """Return whether a plan is followed that makes the measure smaller by a share."""
        return gain > self.threshold * PLAN_THRESHOLD

    def next_step(
        self,
        held: Iterable[TaskRecord],
        robots: frozenset[str],
        last: Callable[[str], RobotStatus | None],
        most: int,
    ) -> tuple[Reallocation, list[Bundle]]:
        """Return what follows, and one bundle of each robot to offer; none at rest.

        Of a fleet larger than `most`, other robots offer in each step.
        """
        schedules = _schedules(held, robots, last)
        longest = max(map(len, schedules), default=0)
        groups = -(-len(schedules) // most)
        if len(robots) < 2 or self.quiet_steps >= PASSES * longest * groups:  # noqa: PLR2004  (two can exchange)
            return self, []
        after = replace(self, turn=self.turn + 1, quiet_steps=self.quiet_steps + 1)
        turn, group = divmod(after.turn, groups)
        # In each pass the same task of one robot meets another task of the next, and other robots
        # only take: who offers something as well cannot take without giving.
        number, turn = divmod(turn, longest)
        bundle = _rest if number % 2 else _one
        return after, [
            bundle(schedule, (turn + number // 2 * place) % len(schedule))
            for place, schedule in enumerate(schedules[group::groups])
            if (place + number) % PASSES
        ]

    def decide(
        self, offers: Iterable[tuple[Bundle, Sequence[Bid]]]
    ) -> tuple[Reallocation, list[Exchange]]:
        """Return what follows, and what changes hands; see `exchanges`."""
        found = exchanges(offers, MEASURES[self.measure], self.threshold)
        return (self.resume() if found else self), found


def _schedules(
    held: Iterable[TaskRecord], robots: frozenset[str], last: Callable[[str], RobotStatus | None]
) -> list[Bundle]:
    """Return the tasks of each robot that have not begun, in the order of its schedule.

    Tasks that its status does not show yet come last.
    """
    schedules = defaultdict(list)
    for record in held:
        if record.state is TaskState.ASSIGNED and record.robot in robots:
            schedules[record.robot].append(record)
    ordered = []
    for robot, records in sorted(schedules.items()):
        status = last(robot)
        place = {task_id: number for number, task_id in enumerate(status.tasks if status else ())}
        ordered.append(
            tuple(sorted(records, key=lambda each: place.get(each.task.id, len(place))))
        )
    return ordered


def _one(schedule: Bundle, place: int) -> Bundle:
    """Return one task of a schedule."""
    return schedule[place : place + 1]


def _rest(schedule: Bundle, place: int) -> Bundle:
    """Return a schedule from a task on, as far as its priority stays the same."""
    priority = schedule[place].task.priority
    return tuple(takewhile(lambda each: each.task.priority == priority, schedule[place:]))


def exchanges(
    offers: Iterable[tuple[Bundle, Sequence[Bid]]],
    measure: Callable[[CostTerms], float],
    threshold: float,
) -> list[Exchange]:
    """Return which bundles change hands, grouped where one move gains only by another.

    Args:
        offers: At most one bundle of each robot, with the bids on it; a bundle that its own robot
            does not bid on stays there.
        measure: What is to fall.
        threshold: It has to fall by more than this share of what changes hands.
    """
    rows = [(bundle, bids, _worth(bids, bundle, measure)) for bundle, bids in offers]
    rows = [row for row in rows if row[0][0].robot in row[2]]
    if not rows:
        return []
    takers = _takers([worth for _, _, worth in rows])
    moves = {}
    gains = {}
    for (bundle, bids, worth), taker in zip(rows, takers, strict=True):
        giver = bundle[0].robot
        if taker != giver:
            taken = next(bid for bid in bids if bid.robot_id == taker)
            moves[giver] = Move(bundle, taken, tuple(bids))
            gains[giver] = worth[giver] - worth[taker] - threshold * worth[giver]
    return [
        exchange for exchange in _linked(moves) if sum(gains[move.giver] for move in exchange) > 0
    ]


def _worth(
    bids: Iterable[Bid], bundle: Bundle, measure: Callable[[CostTerms], float]
) -> dict[str, float]:
    """Return the measure by robot, without robots that have tried one of the tasks in vain."""
    tried = {robot for record in bundle for robot in record.tried} - {bundle[0].robot}
    return {
        bid.robot_id: measure(bid.terms)
        for bid in bids
        if bid.is_able and bid.terms is not None and bid.robot_id not in tried
    }


def _takers(worths: Sequence[Mapping[str, float]]) -> list[str]:
    """Return which robot gets each bundle, at most one each, so that the measure's sum is least.

    `worths` holds the measure by robot for each bundle, whose own robot is always among them.
    """
    robots = sorted({robot for worth in worths for robot in worth})
    costs = np.array([[worth.get(robot, np.inf) for robot in robots] for worth in worths])
    return [robots[column] for column in assignment(costs)]


def _linked(moves: dict[str, Move]) -> list[Exchange]:
    """Return moves, given by their givers, as chains and rings."""
    takers = {move.taker.robot_id for move in moves.values()}
    found = []
    # A chain begins with a giver that takes nothing; the rest are rings and begin anywhere.
    for first in sorted(moves, key=lambda giver: (giver in takers, giver)):
        chain, giver = [], first
        while giver in moves:
            chain.append(moves.pop(giver))
            giver = chain[-1].taker.robot_id
        found.append(tuple(chain))
    return [exchange for exchange in found if exchange]
