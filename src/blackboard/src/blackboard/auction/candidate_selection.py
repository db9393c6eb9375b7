# SPDX-License-Identifier: BSD-3-Clause
"""How far one call for bids reaches: which tasks it offers, and which robots it asks.

Ten thousand tasks for a thousand robots would be ten million bids, nearly all of them too high. A
round gives each robot one task at most, so a call offers the most urgent tasks, as many as a few
rounds can give out, and of a large fleet it asks the robots that are likely to win: those with the
shortest lists, among equals those that are nearest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord


class CandidateSelection:
    """Chooses tasks and robots for one call.

    Args:
        most_asked: Of a larger fleet, so many robots are asked.
        offers_each: So many tasks are offered for each robot that is asked, at most.
        most_bids: So many bids are asked for at most, though at least one of each robot.
        last: Gives the last status of a robot; None where it was never heard.
    """

    def __init__(
        self,
        most_asked: int,
        offers_each: int,
        most_bids: int,
        last: Callable[[str], RobotStatus | None],
    ) -> None:
        self.most_asked = most_asked
        self._offers_each = offers_each
        self._most_bids = most_bids
        self._last = last

    def offers(
        self, records: Sequence[TaskRecord], robots: int, before: Collection[str] = ()
    ) -> Sequence[TaskRecord]:
        """Return what is offered: all of it, or the most urgent and oldest where it is too much.

        What was offered before stays alone until there is less of it than robots and than half a
        call, or something more urgent: bids on it still hold, and for anything new every robot has
        to bid again.

        Args:
            records: Everything that could be.
            robots: How many are asked, at least 1.
            before: Ids of what was offered in the round before.
        """
        most = max(1, min(self._offers_each * robots, self._most_bids // robots))
        if len(records) <= most:
            return records
        by_urgency = sorted(records, key=lambda record: -record.task.priority)
        left = [record for record in by_urgency if record.task.id in before]
        others = [record for record in by_urgency if record.task.id not in before]
        enough = others and len(left) >= min(robots, most / 2)
        if enough and left[-1].task.priority >= others[0].task.priority:
            return left
        return by_urgency[:most]

    def max_bundles(self, robots: int) -> int:
        """Return how many robots may offer something at a time, at least 2.

        Args:
            robots: How many there are.
        """
        bidders = min(robots, 2 * self.most_asked)  # those asked, and those that offer
        return max(2, min(self.most_asked, self._most_bids // max(1, bidders)))

    def asked(self, offers: Sequence[TaskRecord], robots: frozenset[str]) -> frozenset[str]:
        """Return who is asked; all where they are not too many.

        Args:
            offers: What is offered, at least one task.
            robots: Those that are in service.
        """
        if len(robots) <= self.most_asked:
            return robots
        names = sorted(robots)
        statuses = [self._last(name) for name in names]
        places = [(each.pose.x, each.pose.y) if each else (0.0, 0.0) for each in statuses]
        loads = [len(each.tasks) if each else 0 for each in statuses]
        goals = [(record.task.goals[0].x, record.task.goals[0].y) for record in offers]
        path_lengths = np.array(places)[:, np.newaxis] - np.array(goals)
        near = np.linalg.norm(path_lengths, axis=2).min(axis=1)
        best = np.lexsort((near, loads))[: self.most_asked]
        return frozenset(names[index] for index in best)
