# SPDX-License-Identifier: BSD-3-Clause
"""Keeps one traffic planner running beside the blackboard of the member that leads.

The planner is a process of its own, so that planning never holds up a heartbeat. Robots follow the
planner of the highest epoch. A planner knows nothing of the routes that another one has given, so
each one that is started has an epoch of its own: that of the blackboard times `STARTS`, and the
number of the planners that were started in it.

To be loaded takes a planner a second, on a busy machine or with a large map minutes. One that is
being loaded is left alone for as long as it gets on; one that plans speaks once a second.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, Protocol

from hive_common.errors import FileError

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.talker import Talker

PERIOD = 0.25
"""Time between two checks of who leads and whether the planner runs [s]."""

FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0
"""Pause before a planner that has ended is started again [s]; it doubles each time."""

STAYS = 60.0
"""One that has planned for this long counts as a good one: the next pause is the first [s]."""

SILENT = 30.0
"""A planner that shows no sign of life for longer is stuck [s]. While it plans that is a word on
its topic; while it is being loaded, a step that is done, or any work of its processor."""

MOST_WORK = 300.0
"""A step of loading that takes more of the processor's time never ends [s]."""

TELL_PERIOD = 1.0
"""Time between two messages that tell why no planner plans [s]."""

FRESH = 3.0
"""A planner that was heard within this time is not spoken for [s]."""

STARTS = 1000
"""So many planners may be started in one epoch of the blackboard; the last one's epoch is kept."""

TIME_TO_END = 3.0
"""Time that a planner gets to end before it is killed [s]."""


class Progress(NamedTuple):
    """How far a planner is with being loaded.

    Attributes:
        steps: How many steps it has told.
        doing: What it does now, in words; empty before its first word.
        worked: Processor time that its main thread has taken since it was started [s].
    """

    steps: int = 0
    doing: str = ""
    worked: float = 0.0


class Child(Protocol):
    """A process that was started."""

    def progress(self) -> Progress:
        """Return how far it is with being loaded."""

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
        tell: Tells everybody, with an epoch (its own), why no planner plans now.
    """

    def __init__(
        self,
        talker: Talker,
        leads: Callable[[], int | None],
        heard: Callable[[int], float],
        launch: Callable[[int], Child],
        tell: Callable[[int, str], None],
    ) -> None:
        self._talker = talker
        self._leads = leads
        self._heard = heard
        self._launch = launch
        self._tell = tell
        self._tell_at = 0.0
        self._child: Child | None = None
        self._epoch: int | None = None  # of the blackboard that the child belongs to
        self._starts = 0  # in that epoch
        self._started = 0.0
        self._planned = math.inf  # when the child was heard for the first time
        self._alive = 0.0  # when it last showed a sign of life
        self._known = Progress()  # what it had done by then
        self._worked = 0.0  # what it had worked when it told its last step [s]
        self._how = ""  # the last one has ended
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
            how = self._child.ended() or self._why_stuck(self._child)
            if how:
                self._child.kill()
                self._child = None
                self._put_off(how)
        elif self._talker.now() >= self._next_start:
            self._begin(epoch)
        self._tell_why_none(epoch)

    def stop(self) -> None:
        """End the planner, because this member ends; nothing is started any more."""
        self._leads = lambda: None
        self._let_go()

    def _begin(self, epoch: int) -> None:
        self._started = self._alive = self._talker.now()
        self._planned, self._known, self._worked = math.inf, Progress(), 0.0
        self._starts = min(self._starts + 1, STARTS - 1)
        try:
            self._child = self._launch(self._own_epoch(epoch))
        except (OSError, FileError) as error:
            self._put_off(str(error))

    def _own_epoch(self, epoch: int) -> int:
        return epoch * STARTS + self._starts

    def _why_stuck(self, child: Child) -> str:
        """Return for how long the planner has not got on, if that is too long; else empty."""
        now = self._talker.now()
        heard = self._heard(self._own_epoch(self._epoch or 0))
        if heard > -math.inf:
            self._planned = min(self._planned, heard)
            silence = now - max(self._started, heard)
            return f"silent for {silence:.0f} s" if silence > SILENT else ""
        done = child.progress()
        if done.steps != self._known.steps:
            self._worked = done.worked
        if done != self._known:
            self._alive, self._known = now, done
        doing = done.doing or "starts"
        if now - self._alive > SILENT:
            return f"no progress for {now - self._alive:.0f} s while it {doing}"
        if done.worked - self._worked > MOST_WORK:
            return f"worked for {MOST_WORK:.0f} s without a result while it {doing}"
        return ""

    def _tell_why_none(self, epoch: int) -> None:
        """Tell once a second why no planner plans, while none does."""
        now, own = self._talker.now(), self._own_epoch(epoch)
        silence = now - self._heard(own)
        if now < self._tell_at or (self._child is not None and silence <= FRESH):
            return
        self._tell_at = now + TELL_PERIOD
        if self._child is None:
            wait = max(0.0, self._next_start - now)
            why = f"it has ended ({self._how}), and is started again in {wait:.0f} s"
        elif silence < math.inf:
            why = f"it has been silent for {silence:.0f} s"
        else:
            doing = self._known.doing or "starts"
            why = f"it has been loading for {now - self._started:.0f} s, and {doing}"
        self._tell(own, why)

    def _put_off(self, how: str) -> None:
        """Start the planner again after a pause, and say so the first time."""
        now, self._how = self._talker.now(), how
        if now - self._planned >= STAYS:
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
