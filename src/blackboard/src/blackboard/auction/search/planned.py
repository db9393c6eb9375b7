# SPDX-License-Identifier: BSD-3-Clause
"""What a search has found, in terms of robots and tasks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from blackboard.auction.search.explained import Explainer
from blackboard.costing.cost import LATEST_COUNT

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.search.searcher import Found
    from blackboard.auction.search.survey import Surveyed
    from blackboard.domain.bid import Bid
    from blackboard.domain.record import TaskRecord


_GAINS = {
    "waiting": "takes {:.0%} less waiting",
    "makespan": "ends {:.0%} earlier",
    "way": "takes {:.0%} less energy",
}
"""What a plan gains, by the names of `domain.settings.MEASURE_NAMES`."""

_NOTABLE = 0.995  # a smaller gain is not told


@dataclass(frozen=True, slots=True)
class Place:
    """Where a task goes by a plan.

    Attributes:
        record: The task as it was when the plan was begun.
        robot: Who gets it.
        place: In the robot's list; 1 is first.
        bid: What it costs the robot there.
    """

    record: TaskRecord
    robot: str
    place: int
    bid: Bid


@dataclass(frozen=True, slots=True)
class Planned:
    """A plan, and how good it is.

    Attributes:
        places: Where each task goes, list by list.
        left: Tasks that are on no list.
        before: The measure of the lists as they were; infinite if something was on none.
        after: The measure of the plan, and what its moves cost.
        was: The lists as they were, by robot.
        bids: What each task that another robot gets would cost each robot, by the id of the task.
        reason: Why tasks go where they go, in words.
    """

    places: tuple[Place, ...] = ()
    left: tuple[TaskRecord, ...] = ()
    before: float = 0.0
    after: float = 0.0
    was: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    bids: Mapping[str, tuple[Bid, ...]] = field(default_factory=dict)
    reason: str = ""

    @property
    def gain(self) -> float:
        """The share by which the measure falls."""
        if math.isinf(self.before):
            return 1.0
        return (self.before - self.after) / self.before if self.before > self.after else 0.0


def planned(surveyed: Surveyed, found: Found, measure: str) -> Planned:
    """Return the plan that a search has found; `measure` is the name of what it makes small."""
    explainer = Explainer(surveyed, found)
    costs = [explainer.bid_of_taker(task) for task in range(len(surveyed.records))]
    places = tuple(
        Place(surveyed.records[task], surveyed.robots[robot], place, costs[task])
        for robot, row in enumerate(found.plan)
        for place, task in enumerate(row, start=surveyed.fixed[robot] + 1)
    )
    listed = {place.record.task.id for place in places}
    left = tuple(record for record in surveyed.records if record.task.id not in listed)
    was = {
        robot: tuple(surveyed.records[task].task.id for task in row)
        for robot, row in zip(surveyed.robots, surveyed.plan, strict=True)
    }
    bids = explainer.bids()
    reason = _reason(len(places) - 1, found, measure)
    return Planned(places, left, found.before, found.after, was, bids, reason)


def _reason(others: int, found: Found, measure: str) -> str:
    """Return in words with how many others a task was planned, and what that gains."""
    ratio = found.after / found.auctioned if found.auctioned > 0.0 else 1.0
    if measure == "makespan":
        ratio = ratio ** (1.0 / LATEST_COUNT)
    words = f"planned together with {others} other{'s' * (others != 1)}"
    gain = _GAINS[measure].format(1.0 - ratio)
    return f"{words}, which {gain} than by auction" if ratio < _NOTABLE else words
