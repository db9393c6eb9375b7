# SPDX-License-Identifier: BSD-3-Clause
"""What a search has found, in terms of robots and tasks."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blackboard.auction.search.searcher import Found
    from blackboard.auction.search.survey import Surveyed
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class Place:
    """Where a task goes by a plan.

    Attributes:
        record: The task as it was when the plan was begun.
        robot: Who gets it.
        place: In the robot's list; 1 is first.
        eta: Time from then on until it is done [s].
    """

    record: TaskRecord
    robot: str
    place: int
    eta: float


@dataclass(frozen=True, slots=True)
class Planned:
    """A plan, and how good it is.

    Attributes:
        places: Where each task goes, list by list.
        left: Tasks that are on no list.
        before: The measure of the lists as they were; infinite if something was on none.
        after: The measure of the plan, and what its moves cost.
        was: The lists as they were, by robot.
    """

    places: tuple[Place, ...] = ()
    left: tuple[TaskRecord, ...] = ()
    before: float = 0.0
    after: float = 0.0
    was: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def gain(self) -> float:
        """The share by which the measure falls."""
        if math.isinf(self.before):
            return 1.0
        return (self.before - self.after) / self.before if self.before > self.after else 0.0


def planned(surveyed: Surveyed, found: Found) -> Planned:
    """Return the plan that a search has found."""
    places = tuple(
        Place(surveyed.records[task], surveyed.robots[robot], place, eta)
        for robot, row in enumerate(found.plan)
        for place, (task, eta) in enumerate(
            zip(row, surveyed.problem.times(robot, row), strict=True),
            start=surveyed.fixed[robot] + 1,
        )
    )
    listed = {place.record.task.id for place in places}
    left = tuple(record for record in surveyed.records if record.task.id not in listed)
    was = {
        robot: tuple(surveyed.records[task].task.id for task in row)
        for robot, row in zip(surveyed.robots, surveyed.plan, strict=True)
    }
    return Planned(places, left, found.before, found.after, was)
