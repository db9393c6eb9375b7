# SPDX-License-Identifier: BSD-3-Clause
"""Timing: simulated time against the wall clock, and what is due in simulated time."""

from __future__ import annotations

TICK = 0.02  # approximate period of /clock, on the wall clock [s]
SLACK = 0.1  # maximum lag that a run catches up; any further lag stays [s, wall clock]
WINDOW = 5.0  # period over which the reached factor is measured [s, wall clock]
ENOUGH = 0.95  # share of the wanted factor that counts as reached
NEWS = 0.2  # weight of the latest tick in the estimated cost of a step


class Pacer:
    """Keeps simulated time at a given factor of wall time.

    A tick is one or several steps of the simulation. If a machine cannot keep up, no step is
    skipped or lengthened: simulated time goes slower, and `reached` says by how much. Ticks then
    have fewer steps, so that /clock comes as often as before.
    """

    def __init__(self, factor: float, step: float, now: float) -> None:
        """Start at `now`, monotonic wall time [s].

        `factor`, above 0, is simulated time per wall time; `step` is one of the simulation [s].
        """
        self._most = max(1, round(factor * TICK / step))
        self.steps = self._most  # steps of the simulation in the next tick
        self.reached: float | None = None  # factor over the last window if it fell short
        self._factor = factor
        self._step = step
        self._next = self._begun = self._window_start = now
        self._gone = 0.0
        self._cost = 0.0

    def tick_done(self, now: float) -> float:
        """Return how long to sleep before the next tick [s]; `now` is wall time [s]."""
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
    """Says when something is due at a fixed rate of simulated time."""

    def __init__(self, rate: float, step: float, phase: int = 0) -> None:
        """Begin at time 0.

        Args:
            rate: [Hz]; at most once a step.
            step: Length of a step of the simulation [s].
            phase: Shift in steps, so that not everything is due at once.
        """
        self._step = round(step * 1e9)
        self._period = max(round(1e9 / rate), self._step)
        self._shift = phase * self._step % self._period
        self._number: int | None = None

    def due(self, nanoseconds: int) -> bool:
        """Return whether it is due in the step that ended at this time [ns]."""
        return (nanoseconds + self._shift) % self._period < self._step

    def has_come(self, nanoseconds: int) -> bool:
        """Return whether it has become due by this time [ns] since the last call."""
        number = (nanoseconds + self._shift) // self._period
        before, self._number = self._number, number
        return number != before
