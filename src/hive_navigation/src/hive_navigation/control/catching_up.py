# SPDX-License-Identifier: BSD-3-Clause
"""Lets a control loop catch up with simulated time before it acts.

Clock, scans, transforms and announcements come by different connections. On a busy machine, or in
a fast simulation, a loop may hear what time it is long before it hears what its robot senses then.
A simulator that waits for the robot's commands waits for all of this if the loop does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_common.patience import listen_until

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

RECENT = 0.15
"""Older than this a pose or a transform is late [s, simulated time]. They come at 10 Hz at least,
and time goes on by up to 0.05 s before they are told."""

SLACK = 0.05  # how much later than after its period a scan is late [s, simulated time]
ANNOUNCED = 0.3  # older than this an announcement is late [s, simulated time]; claims last longer
PATIENCE = 0.8  # how long to wait [s, see `listen_until`]; less than a simulator waits
MOVED_ON = 0.1  # after so long nobody waits for this loop [s, simulated time]
LOOK = 0.002  # time between two looks whether all has come [s, wall clock]


class CatchingUp:
    """Waits until everything that a control loop acts on is recent.

    What did not come in time is not waited for again until it was in time once more, and what was
    never in time is not waited for at all: a sensor that is dead or slow stops nobody. A wait
    ends, too, when time has gone on meanwhile: then no simulator waits for this loop.

    Args:
        time: The time that the robot lives in [s].
        wall: A clock of the machine [s].
        patience: How long to wait [s, see `listen_until`].
    """

    def __init__(
        self, time: Callable[[], float], wall: Callable[[], float], patience: float = PATIENCE
    ) -> None:
        self._time = time
        self._wall = wall
        self._patience = patience
        self._in_time: set[str] = set()

    def wait(
        self,
        recent_until: Callable[[], Mapping[str, float]],
        listen: Callable[[float], None],
    ) -> tuple[str, ...]:
        """Wait for what is late at the time at which this is called.

        Args:
            recent_until: Says of each thing, by name, until when it counts as recent [s].
            listen: Takes in what comes for up to that long [s, wall clock].

        Returns:
            What did not come in `patience`, in the order of its names.
        """
        begun = self._time()
        late: set[str] = set()

        def is_over() -> bool:
            nonlocal late
            late = self._late(recent_until(), begun)
            return not late or self._time() - begun > MOVED_ON

        if listen_until(is_over, self._patience, listen, self._wall, LOOK):
            return ()
        self._in_time -= late
        return tuple(sorted(late))

    def _late(self, recent_until: Mapping[str, float], now: float) -> set[str]:
        """Return what is late now, of what was in time before."""
        late = {name for name, until in recent_until.items() if until < now}
        self._in_time |= recent_until.keys() - late
        return late & self._in_time
