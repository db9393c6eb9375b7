# SPDX-License-Identifier: BSD-3-Clause
"""Timing: simulated time against the wall clock, and what is due in simulated time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hive_common.patience import listen_until

if TYPE_CHECKING:
    from collections.abc import Callable

TICK = 0.02  # approximate period of /clock, on the wall clock [s]
MAX_STEPS_DRIVEN = 2  # in a tick while a control loop drives: it senses what the last tick told
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
        self.steps = self._most  # maximum number of steps in the next tick
        self.reached: float | None = None  # factor over the last window if it fell short
        self._factor = factor
        self._step = step
        self._next = self._begun = self._window_start = now
        self._gone = 0.0
        self._cost = 0.0

    def tick_done(self, now: float, steps: int) -> float:
        """Return how long to sleep after a tick of some steps [s]; `now` is wall time [s]."""
        gone = steps * self._step
        self._gone += gone
        self._next = max(self._next + gone / self._factor, now - SLACK)
        window = now - self._window_start
        if window >= max(WINDOW, 2 * self._most * self._step / self._factor):
            reached = self._gone / window
            self.reached = reached if reached < ENOUGH * self._factor else None
            self._window_start, self._gone = now, 0.0
        pause = max(self._next - now, 0.0)
        self._cost += NEWS * ((now - self._begun) / steps - self._cost)
        self._begun = now + pause
        in_time = self._cost * self._most <= TICK
        self.steps = self._most if in_time else max(1, int(TICK / self._cost))
        return pause


@dataclass
class _Driver:
    """The control loop that drives a robot."""

    period: int  # between two commands [ns, simulated time]
    heard: int  # when its last command came [ns, simulated time]
    awaited: bool  # whether simulated time waits for its next one
    is_there: Callable[[], bool]  # whether it can still send one


class Lockstep:
    """Keeps simulated time from running ahead of the control loops that drive robots.

    A control loop that follows /clock sends a command every period while its robot moves. Once a
    command is due, simulated time waits for it, so a busy machine makes a run slower and not
    different. A loop that lets the simulation wait for `timeout` is not waited for again until its
    next command, and one that has ended is not waited for at all.
    """

    def __init__(self, timeout: float) -> None:
        """Wait up to `timeout` [s, see `listen_until`] for a command; 0 waits for none."""
        self._timeout = timeout
        self._drivers: dict[str, _Driver] = {}

    def note(
        self,
        name: str,
        nanoseconds: int,
        period: float,
        *,
        moves: bool,
        is_there: Callable[[], bool] = lambda: True,
    ) -> None:
        """Note a command.

        Args:
            name: The robot.
            nanoseconds: Simulated time [ns].
            period: Of the control loop [s]; 0 if it follows another clock.
            moves: Whether the robot moves with it; nobody repeats a command to stand still.
            is_there: Says whether the control loop can still send a command.
        """
        awaited = moves and period > 0.0
        self._drivers[name] = _Driver(round(period * 1e9), nanoseconds, awaited, is_there)

    def forget(self, name: str) -> None:
        """Forget a robot that was removed."""
        self._drivers.pop(name, None)

    def wait(
        self, nanoseconds: int, listen: Callable[[float], None], wall: Callable[[], float]
    ) -> tuple[str, ...]:
        """Wait until no command is due, or the timeout is over.

        Args:
            nanoseconds: Simulated time [ns].
            listen: Takes in commands for up to that long [s, wall clock].
            wall: Gives the wall clock [s].

        Returns:
            The robots whose commands did not come.
        """
        listen_until(lambda: not self._due(nanoseconds), self._timeout, listen, wall)
        late = self._due(nanoseconds)
        for name in late:
            self._drivers[name].awaited = False
        return late

    def steps_until_due(self, nanoseconds: int, step: float, most: int) -> int:
        """Return how many steps [s] to take, 1..`most`, before the next command is due.

        While a control loop drives there are at most `MAX_STEPS_DRIVEN`.
        """
        ends = [d.heard + d.period for d in self._drivers.values() if d.awaited]
        if not ends:
            return most
        left = math.ceil((min(ends) - nanoseconds) / (step * 1e9))
        return max(1, min(left, most, MAX_STEPS_DRIVEN))

    def _due(self, nanoseconds: int) -> tuple[str, ...]:
        """Return whose commands are due, of the control loops that are still there."""
        due = []
        for name, driver in self._drivers.items():
            if driver.awaited and nanoseconds - driver.heard >= driver.period:
                driver.awaited = driver.is_there()
                if driver.awaited:
                    due.append(name)
        return tuple(due)


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
