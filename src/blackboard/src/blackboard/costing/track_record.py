# SPDX-License-Identifier: BSD-3-Clause
"""How well a robot has predicted its tasks, and the margins that follow from that.

The margins are those of split conformal prediction over the last tasks (Vovk, Gammerman and
Shafer, "Algorithmic Learning in a Random World", 2005): they hold for nine of ten tasks whatever
the errors look like.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

KEPT = 100
"""Tasks that count; what was long ago tells nothing of today's floor."""

COVERED = 0.9
"""The share of tasks that take no more than predicted and the margin."""

_LEARNING = 3
"""Tasks that no margin counts, at first and after a change: the robot learns from them."""


class Outcome(NamedTuple):
    """What was predicted of a task when it began, and what it took.

    Attributes:
        date: When it was done [s], on the clock of `Task.posted`.
        formula_time, predicted_time: By the formula, and by what was learned [s].
        most_time: What nine of ten such tasks take at most [s].
        time: What it took [s].
        formula_energy, predicted_energy, most_energy, energy: The same of its energy [J].
    """

    date: float
    formula_time: float
    predicted_time: float
    most_time: float
    time: float
    formula_energy: float
    predicted_energy: float
    most_energy: float
    energy: float

    @property
    def is_usable(self) -> bool:
        """Whether it says something: there was something to do, and the battery was measured."""
        return min(self[1:]) > 0.0 and math.isfinite(sum(self))


class TrackRecord:
    """A robot's last tasks, as predicted and as they were.

    Attributes:
        outcomes: The last `KEPT` tasks, oldest first.
        settled: How many tasks the margins count; below 0 while they count none yet.
    """

    def __init__(self, outcomes: Iterable[Outcome] = (), settled: int = -_LEARNING) -> None:
        self.outcomes: deque[Outcome] = deque(outcomes, KEPT)
        self.settled = settled

    def add(self, outcome: Outcome) -> None:
        """Take in a task."""
        self.outcomes.append(outcome)
        self.settled += 1

    def unsettle(self) -> None:
        """Count no task so far for the margins: things have changed."""
        self.settled = -_LEARNING

    @property
    def _counted(self) -> list[Outcome]:
        """The tasks that count for margins."""
        return list(self.outcomes)[-self.settled :] if self.settled > 0 else []

    def time_margin(self, otherwise: float) -> float:
        """Return the margin of `Learned.time_margin` [√s].

        `otherwise` is returned until there are enough tasks to say.
        """
        late = (
            (each.time - each.predicted_time) / math.sqrt(each.predicted_time)
            for each in self._counted
        )
        return _quantile(late, otherwise)

    def energy_margin(self, otherwise: float) -> float:
        """Return the margin of `Learned.energy_margin`; see `time_margin`."""
        more = (each.energy / each.predicted_energy - 1.0 for each in self._counted)
        return _quantile(more, otherwise)


def _quantile(scores: Iterable[float], otherwise: float) -> float:
    """Return what a further score exceeds once in ten times; at least 0.

    Between two scores it is interpolated: the next higher one would cover too much of few scores.
    """
    ordered = sorted(scores)
    place = (len(ordered) + 1) * COVERED - 1
    if place > len(ordered) - 1:
        return otherwise
    below = math.floor(place)
    lower, upper = ordered[below], ordered[min(below + 1, len(ordered) - 1)]
    return max(0.0, lower + (place - below) * (upper - lower))
