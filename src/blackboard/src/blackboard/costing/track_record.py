# SPDX-License-Identifier: BSD-3-Clause
"""How well a robot has predicted its tasks: margins, and whether something has changed.

The margins are those of split conformal prediction over the last tasks (Vovk, Gammerman and
Shafer, "Algorithmic Learning in a Random World", 2005): they hold for nine of ten tasks whatever
the errors look like. A change is found by the test of Page and Hinkley (Page, "Continuous
Inspection Schemes", Biometrika 41, 1954).
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

_LARGEST = 0.3
"""A task that is off by a larger share counts as off by this one when a change is looked for."""

_USUAL = 0.1
"""An error of this share is no sign of a change."""

_CHANGED = 0.5
"""What errors beyond the usual one have to add up to: three tasks in a row, each off by 30 %."""


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


class _Shift:
    """Finds errors that go to one side for several tasks, by the test of Page and Hinkley."""

    def __init__(self) -> None:
        self._sums = [0.0, 0.0]

    def add(self, ratio: float) -> str:
        """Take in what a task took, as a share of what was predicted.

        Returns:
            In words how much more or less tasks take now; empty if nothing has changed. Then the
            test begins anew.
        """
        error = min(max(ratio - 1.0, -_LARGEST), _LARGEST)
        self._sums = [
            max(0.0, so_far + side * error - _USUAL)
            for side, so_far in zip((1.0, -1.0), self._sums, strict=True)
        ]
        if max(self._sums) < _CHANGED:
            return ""
        self._sums = [0.0, 0.0]
        return f"{abs(ratio - 1.0):.0%} {'more' if ratio > 1.0 else 'less'}"


class TrackRecord:
    """A robot's last tasks, as predicted and as they were.

    Attributes:
        outcomes: The last `KEPT` tasks, oldest first.
        settled: How many tasks the margins count; below 0 while they count none yet.
    """

    def __init__(self, outcomes: Iterable[Outcome] = (), settled: int = -_LEARNING) -> None:
        self.outcomes: deque[Outcome] = deque(outcomes, KEPT)
        self.settled = settled
        self._time, self._energy = _Shift(), _Shift()

    def add(self, outcome: Outcome) -> tuple[str, str]:
        """Take in a task.

        Returns:
            In words what has changed in the time and in the energy of tasks; empty texts most of
            the time.
        """
        self.outcomes.append(outcome)
        self.settled += 1
        time = self._time.add(outcome.time / outcome.predicted_time)
        energy = self._energy.add(outcome.energy / outcome.predicted_energy)
        if time or energy:
            self.settled = -_LEARNING
        return time and f"its tasks take {time} time than predicted", (
            energy and f"its tasks draw {energy} energy than predicted"
        )

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
    """Return what a further score exceeds once in ten times; at least 0."""
    ordered = sorted(scores)
    place = math.ceil((len(ordered) + 1) * COVERED) - 1
    return max(0.0, ordered[place]) if place < len(ordered) else otherwise
