# SPDX-License-Identifier: BSD-3-Clause
"""Keeps one traffic planner running beside the blackboard of the member that leads.

The planner is a process of its own, so that planning never holds up a heartbeat. Robots follow the
planner of the highest epoch. A planner knows nothing of the routes that another one has given, so
each one that is started has an epoch of its own: that of the blackboard times `STARTS`, and the
number of the planners that were started in it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from hive_common.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.talker import Talker

PERIOD = 0.25
"""Time between two checks of who leads and whether the planner runs [s]."""

FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
"""Pause before a planner that has ended is started again [s]; it doubles each time."""

STAYS = 60.0
"""A planner that has run for this long counts as a good one: the next pause is the first [s]."""

SILENT = 30.0
"""A planner that says nothing for longer is stuck [s]; it speaks once a second, but on a busy
machine its first plan takes some seconds."""

STARTS = 1000
"""So many planners may be started in one epoch of the blackboard; the last one's epoch is kept."""

TIME_TO_END = 3.0
"""Time that a planner gets to end before it is killed [s]."""


class Child(Protocol):
    """A process that was started."""

    def ended(self) -> str:
        """Return how it has ended, in words; empty while it runs."""

    def end(self) -> None:
        """Ask it to end; it need not obey."""

    def kill(self) -> None:
        """End it at once."""


class PlannerKeeper:
    """Starts, restarts and ends the planner of a member.

    Args:
        talker: Its clock and its log.
        leads: Returns the epoch that this member leads now; None while it does not lead.
        heard: Returns when a planner of an epoch (its own) was heard last [s]; -inf if never.
        launch: Starts the planner of an epoch (its own, see above); raises OSError if it cannot.
    """

    def __init__(
        self,
        talker: Talker,
        leads: Callable[[], int | None],
        heard: Callable[[int], float],
        launch: Callable[[int], Child],
    ) -> None:
        self._talker = talker
        self._leads = leads
        self._heard = heard
        self._launch = launch
        self._child: Child | None = None
        self._epoch: int | None = None  # of the blackboard that the child belongs to
        self._starts = 0  # in that epoch
        self._started = 0.0
        self._next_start = 0.0
        self._pause = FIRST_PAUSE
        self._ending: list[tuple[float, Child]] = []  # with the time to kill it [s]

    def start(self) -> None:
        """Begin to keep a planner running."""
        self._talker.every(PERIOD, self.look)

    def look(self) -> None:
        """Do what has to be done now."""
        self._bury()
        epoch = self._leads()
        if epoch != self._epoch:
            self._let_go()
            self._epoch, self._starts = epoch, 0
            self._pause, self._next_start = FIRST_PAUSE, 0.0
        if epoch is None:
            return
        if self._child is not None:
            how = self._child.ended() or self._why_stuck()
            if how:
                self._child.kill()
                self._child = None
                self._put_off(how)
        elif self._talker.now() >= self._next_start:
            self._begin(epoch)

    def stop(self) -> None:
        """End the planner, because this member ends; nothing is started any more."""
        self._leads = lambda: None
        self._let_go()

    def _begin(self, epoch: int) -> None:
        self._started = self._talker.now()
        self._starts = min(self._starts + 1, STARTS - 1)
        try:
            self._child = self._launch(self._own_epoch(epoch))
        except (OSError, FileError) as error:
            self._put_off(str(error))

    def _own_epoch(self, epoch: int) -> int:
        return epoch * STARTS + self._starts

    def _why_stuck(self) -> str:
        """Return for how long the planner has been silent, if that is too long; else empty."""
        last = max(self._started, self._heard(self._own_epoch(self._epoch or 0)))
        silence = self._talker.now() - last
        return f"silent for {silence:.0f} s" if silence > SILENT else ""

    def _put_off(self, how: str) -> None:
        """Start the planner again after a pause, and say so the first time."""
        now = self._talker.now()
        if now - self._started >= STAYS:
            self._pause = FIRST_PAUSE
        if self._pause == FIRST_PAUSE:
            self._talker.warn(
                f"the traffic planner has ended ({how}); robots drive by right of way until it "
                f"runs again, which is tried after {FIRST_PAUSE:g} s and then ever less often"
            )
        self._next_start = now + self._pause
        self._pause = min(2 * self._pause, LONGEST_PAUSE)

    def _let_go(self) -> None:
        """Ask the planner to end, and forget it."""
        if self._child is not None and not self._child.ended():
            self._child.end()
            self._ending.append((self._talker.now() + TIME_TO_END, self._child))
        self._child = None

    def _bury(self) -> None:
        """Kill what does not end in time."""
        now = self._talker.now()
        self._ending = [(by, child) for by, child in self._ending if not child.ended()]
        for by, child in self._ending:
            if now >= by:
                child.kill()
