# SPDX-License-Identifier: BSD-3-Clause
"""Limits one call for bids: which tasks it offers, and which robots it asks.

Ten thousand tasks for a thousand robots would be ten million bids, nearly all of them too high. A
round awards at most one task to each robot, so a call offers the most urgent tasks, as many as a
few rounds can award. Of a large fleet it asks the robots that are likely to win: those with the
shortest schedules, and among equals the nearest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord


@dataclass(frozen=True, slots=True)
class CandidateSelection:
    """Chooses tasks and robots for one call."""

    max_asked: int  # of a larger fleet, this many robots are asked
    offers_each: int  # at most this many tasks are offered for each robot asked
    max_bids: int  # at most this many bids are requested, though at least one from each robot

    def offers(
        self, records: Sequence[TaskRecord], robots: int, before: Collection[str] = ()
    ) -> Sequence[TaskRecord]:
        """Return what is offered: everything, or the most urgent and oldest if that is too much.

        The rest of the last offer stays alone until it is less than one task for each robot and
        half a call, or something more urgent comes: bids on it still hold, and for a new task
        every robot has to bid again. `robots` are asked, at least 1; `before` holds the ids of the
        tasks offered in the last round.
        """
        most = max(1, min(self.offers_each * robots, self.max_bids // robots))
        if len(records) <= most:
            return records
        by_urgency = sorted(records, key=lambda record: -record.task.priority)
        left = [record for record in by_urgency if record.task.id in before]
        others = [record for record in by_urgency if record.task.id not in before]
        enough = others and len(left) >= min(robots, most / 2)
        if enough and left[-1].task.priority >= others[0].task.priority:
            return left
        return by_urgency[:most]

    def asked(
        self,
        offers: Sequence[TaskRecord],
        robots: frozenset[str],
        last: Callable[[str], RobotStatus | None],
    ) -> frozenset[str]:
        """Return which of the robots in service are asked for bids on at least one offer."""
        if len(robots) <= self.max_asked:
            return robots
        names = sorted(robots)
        statuses = [last(name) for name in names]
        places = [(each.pose.x, each.pose.y) if each else (0.0, 0.0) for each in statuses]
        loads = [len(each.tasks) if each else 0 for each in statuses]
        goals = [(record.task.goals[0].x, record.task.goals[0].y) for record in offers]
        offsets = np.array(places)[:, np.newaxis] - np.array(goals)
        near = np.linalg.norm(offsets, axis=2).min(axis=1)
        best = np.lexsort((near, loads))[: self.max_asked]
        return frozenset(names[index] for index in best)
