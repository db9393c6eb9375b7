# SPDX-License-Identifier: BSD-3-Clause
"""What has to happen for a plan to come true: awards, transfers, and other places in lists.

A plan is some tenths of a second old when it is made. Tasks that have changed since are left out,
and the next plan knows of it.

A robot that bids itself is on no list of a plan. It gets the task on which its bid is lowest
against what the plan has for it, one with each plan, because its other bids do not hold then.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.auction.search.offers import MOST
from blackboard.auction.transfers import Move
from blackboard.domain.bid import ranked
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from blackboard.auction.search.planned import Place, Planned
    from blackboard.auction.transfers import Moves
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord

    Bids = Mapping[str, Mapping[str, Bid]]

_PAYS = 0.9
"""A bid on a task that another robot has needs to be below this share of what it costs there."""


@dataclass(frozen=True, slots=True)
class Steps:
    """What a plan asks for.

    Attributes:
        awards: Of tasks that wait, in the order of the lists; a round awards the next of each.
        places: Where each of them goes in its robot's list; 1 is first.
        bids: All bids on each of them, by its id.
        moves: Of tasks that another robot has.
        reorders: Tasks that stay with their robots at other places, each with its place.
    """

    awards: tuple[Bid, ...] = ()
    places: Mapping[str, int] = field(default_factory=dict)
    bids: Mapping[str, tuple[Bid, ...]] = field(default_factory=dict)
    moves: Moves = ()
    reorders: tuple[tuple[TaskRecord, int], ...] = ()


def steps_to(
    planned: Planned,
    records: Mapping[str, TaskRecord],
    in_service: frozenset[str],
    others: Bids,
    *,
    keeps_lists: bool = False,
) -> Steps:
    """Return what leads to a plan from the tasks as they are now.

    `others` holds the bids of robots that bid themselves, by robot and task. If `keeps_lists`, the
    plan is not worth its moves, and only these robots get tasks.
    """
    fresh = [
        place
        for place in planned.places
        if place.robot in in_service and records.get(place.record.task.id) == place.record
    ]
    taken = _taken(fresh, others, in_service)
    where = _places(planned.places, taken)
    awards, moves, kept, bids = [], [], defaultdict(list), {}
    for place in fresh:
        task_id = place.record.task.id
        goes_to = taken.get(task_id, place.bid)
        if keeps_lists and task_id not in taken:
            continue
        bids[task_id] = planned.bids.get(task_id, (place.bid,)) + _told(
            task_id, others, goes_to, MOST // len(fresh)
        )
        if place.record.state is TaskState.WAITING:
            awards.append(goes_to)
        elif place.record.robot != goes_to.robot_id or _is_put_behind(place):
            moves.append(Move(place.record, goes_to, bids[task_id], where.get(task_id, 0)))
        else:
            kept[place.robot].append(place)
    reorders = [
        (place.record, where[place.record.task.id])
        for robot, places in kept.items()
        if _is_reordered(places, planned.was.get(robot, ()))
        for place in places
    ]
    return Steps(tuple(awards), where, bids, tuple(moves), tuple(reorders))


def _taken(places: Iterable[Place], others: Bids, in_service: frozenset[str]) -> dict[str, Bid]:
    """Return the bids of robots that bid themselves which are better than the plan, by task.

    Those that are better by most come first; each robot gets one task.
    """
    better = []
    for place in places:
        record = place.record
        pays = 1.0 if record.state is TaskState.WAITING else _PAYS
        for robot in in_service & others.keys():
            bid = others[robot].get(record.task.id)
            if bid is None or not bid.is_able or robot in record.tried:
                continue
            if record.state is not TaskState.STARTED and pays * place.bid.cost > bid.cost:
                better.append((bid.cost - pays * place.bid.cost, robot, bid))
    taken: dict[str, Bid] = {}
    served = set()
    for _, robot, bid in sorted(better, key=lambda each: each[:2]):
        if robot not in served and bid.task_id not in taken:
            served.add(robot)
            taken[bid.task_id] = bid
    return taken


def _places(places: Iterable[Place], taken: Mapping[str, Bid]) -> dict[str, int]:
    """Return where tasks go in their lists, without those that others get.

    A task that is on a list leaves it later, when its robot has handed it back.
    """
    where = {}
    gone: dict[str, int] = defaultdict(int)  # by robot
    for place in places:
        task_id = place.record.task.id
        if task_id not in taken:
            where[task_id] = place.place - gone[place.robot]
        elif place.record.state is TaskState.WAITING:
            gone[place.robot] += 1
    return where


def _told(task_id: str, others: Bids, taker: Bid, most: int) -> tuple[Bid, ...]:
    """Return the best bids of robots that bid themselves, and that of the robot that gets it."""
    best = ranked(each[task_id] for each in others.values() if task_id in each)[: max(1, most)]
    if taker.robot_id in others and taker not in best:
        best.append(taker)
    return tuple(best)


def _is_put_behind(place: Place) -> bool:
    """Return whether a robot that has just begun a task is to do others first."""
    return place.record.state is TaskState.STARTED and place.place > 1


def _is_reordered(places: list[Place], was: tuple[str, ...]) -> bool:
    """Return whether tasks that stay with a robot are to follow each other differently."""
    stay = [each.record.task.id for each in places if each.record.task.id in set(was)]
    return stay != [task_id for task_id in was if task_id in set(stay)]
