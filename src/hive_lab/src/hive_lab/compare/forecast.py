# SPDX-License-Identifier: BSD-3-Clause
"""Says how long runs still take, by what those before have taken."""

from __future__ import annotations

from statistics import mean
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable, Sequence

    from fleet_manager.config.scenario import Scenario

_LEAST_SHARE = 0.02  # of the first run; below it the remaining time is anybody's guess
_TAIL = 60.0  # from the last posting until the last task has ended, if nothing is known [s]


class Forecast:
    """Follows runs that are made one after the other.

    Args:
        kinds: Of each run what it has in common with others that take about as long.
    """

    def __init__(self, kinds: Sequence[Hashable]) -> None:
        self._kinds = kinds
        self._took: list[float] = []

    def note(self, took: float) -> None:
        """Note how long the next run has taken [s]."""
        self._took.append(took)

    def remaining(self, elapsed: float, share: float) -> float | None:
        """Return the time until all runs have been made [s].

        Args:
            elapsed: How long the run under way has taken [s].
            share: How much of it is done, 0..1.

        Returns:
            None below 2 % of the first run.
        """
        number = len(self._took)
        if number >= len(self._kinds):
            return 0.0
        usual = self._usual(self._kinds[number])
        if usual is None:
            if share < _LEAST_SHARE:
                return None
            usual = elapsed / share
        # The further it is, the more its own pace counts.
        this = (1.0 - share) * ((1.0 - share) * usual + elapsed)
        whole = elapsed + this
        later = [self._usual(kind) or whole for kind in self._kinds[number + 1 :]]
        return this + sum(later)

    def _usual(self, kind: Hashable) -> float | None:
        """Return how long runs of a kind take [s], by those of the same kind if there are any."""
        known = list(zip(self._kinds, self._took, strict=False))
        same = [took for other, took in known if other == kind]
        return mean(same or self._took) if known else None


def share_of_run(scenario: Scenario, now: float, ended: float) -> float:
    """Return how much of a run is done, 0..1.

    Args:
        scenario: What is posted, and when.
        now: Time since the first posting [s].
        ended: Share of the tasks that have ended, 0..1. Of tasks that come over time, those that
            come at once end soon, so the time counts too.
    """
    last = max(planned.after for planned in scenario.tasks)
    by_tasks = min(ended, now / (last + _TAIL)) if last else ended
    return max(by_tasks, min(1.0, now / scenario.time_limit))
