# SPDX-License-Identifier: BSD-3-Clause
"""What has to happen for a plan to come true: awards, transfers, and other places in lists.

A plan is some tenths of a second old when it is made. Tasks that have changed since are left out,
and the next plan knows of it.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.auction.transfers import Move
from blackboard.domain.bid import Bid
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.search.planned import Place, Planned
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Steps:
    """What a plan asks for.

    Attributes:
        awards: Of tasks that wait, in the order of the lists; a round awards the next of each.
        places: Where each of them goes in its robot's list; 1 is first.
        moves: Of tasks that another robot has.
        reorders: Tasks that stay with their robots at other places, each with its place.
    """

    awards: tuple[Bid, ...]
    places: Mapping[str, int]
    moves: tuple[Move, ...]
    reorders: tuple[tuple[TaskRecord, int], ...]


def steps_to(
    planned: Planned, records: Mapping[str, TaskRecord], in_service: frozenset[str]
) -> Steps:
    """Return what leads to a plan from the tasks as they are now."""
    awards, moves, kept = [], [], defaultdict(list)
    for place in planned.places:
        if place.robot not in in_service or records.get(place.record.task.id) != place.record:
            continue
        if place.record.state is TaskState.WAITING:
            awards.append(_bid(place))
        elif place.record.robot != place.robot or _is_put_behind(place):
            bids = planned.bids.get(place.record.task.id, ())
            moves.append(Move((place.record,), _bid(place), bids, place.place))
        else:
            kept[place.robot].append(place)
    reorders = [
        (place.record, place.place)
        for robot, places in kept.items()
        if _is_reordered(places, planned.was.get(robot, ()))
        for place in places
    ]
    places = {place.record.task.id: place.place for place in planned.places}
    return Steps(tuple(awards), places, tuple(moves), tuple(reorders))


def _is_put_behind(place: Place) -> bool:
    """Return whether a robot that has just begun a task is to do others first."""
    return place.record.state is TaskState.STARTED and place.place > 1


def _bid(place: Place) -> Bid:
    return Bid(place.robot, place.record.task.id, 0.0, eta=place.eta)


def _is_reordered(places: list[Place], was: tuple[str, ...]) -> bool:
    """Return whether tasks that stay with a robot are to follow each other differently."""
    stay = [place.record.task.id for place in places]
    return stay != [task_id for task_id in was if task_id in set(stay)]
