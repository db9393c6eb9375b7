# SPDX-License-Identifier: BSD-3-Clause
"""When to do what: simulated time against the wall clock, and what is due in simulated time."""

from __future__ import annotations

TICK = 0.02
"""About how often the simulated clock is told, on the wall clock [s]."""

SLACK = 0.1
"""How far a run may lag and still catch up; what is behind more stays behind [s, wall clock]."""

WINDOW = 5.0
"""Over how long it is measured what factor is reached [s, wall clock]."""

ENOUGH = 0.95
"""Share of the factor asked for that counts as reached."""

NEWS = 0.2
"""Share of the latest tick in what a step is taken to cost."""


class Pacer:
    """Keeps simulated time at a given factor of the time on the wall.

    One tick is one or several steps of the simulation. Where a machine cannot keep up, no step is
    skipped or made longer: simulated time goes slower, and `reached` says by how much. A tick has
    fewer steps then, so that whoever steers by the clock hears it as often as before.

    Attributes:
        steps: How many steps of the simulation make the next tick.
        reached: The factor over the last window if it fell short, None while all is well.
    """

    def __init__(self, factor: float, step: float, now: float) -> None:
        """Start at `now`.

        Args:
            factor: Simulated time per time on the wall, above 0.
            step: Length of a step of the simulation [s].
            now: Reading of a clock on the wall that never goes back [s].
        """
        self._most = max(1, round(factor * TICK / step))
        self.steps = self._most
        self.reached: float | None = None
        self._factor = factor
        self._step = step
        self._next = self._begun = self._window_start = now
        self._gone = 0.0
        self._cost = 0.0

    def tick_done(self, now: float) -> float:
        """Return how long to sleep before the next tick [s], at least 0.

        Args:
            now: Reading of the clock on the wall after the tick [s].
        """
        gone = self.steps * self._step
        self._gone += gone
        self._next = max(self._next + gone / self._factor, now - SLACK)
        window = now - self._window_start
        if window >= max(WINDOW, 2 * self._most * self._step / self._factor):
            reached = self._gone / window
            self.reached = reached if reached < ENOUGH * self._factor else None
            self._window_start, self._gone = now, 0.0
        pause = max(self._next - now, 0.0)
        self._cost += NEWS * ((now - self._begun) / self.steps - self._cost)
        self._begun = now + pause
        in_time = self._cost * self._most <= TICK
        self.steps = self._most if in_time else max(1, int(TICK / self._cost))
        return pause


class Every:
    """Something that is due at a fixed rate of simulated time."""

    def __init__(self, rate: float, step: float, phase: int = 0) -> None:
        """Plan it.

        Args:
            rate: How often [Hz]; at most once a step.
            step: Length of a step of the simulation [s].
            phase: By how many steps it is shifted, so that not everything is due at once.
        """
        self._step = round(step * 1e9)
        self._period = max(round(1e9 / rate), self._step)
        self._shift = phase * self._step % self._period
        self._number: int | None = None

    def due(self, nanoseconds: int) -> bool:
        """Say whether it is due in the step that ended at this time [ns]."""
        return (nanoseconds + self._shift) % self._period < self._step

    def has_come(self, nanoseconds: int) -> bool:
        """Say whether it has become due since this was asked last, some steps ago.

        Args:
            nanoseconds: The time [ns].
        """
        number = (nanoseconds + self._shift) // self._period
        before, self._number = self._number, number
        return number != before
