# SPDX-License-Identifier: BSD-3-Clause
"""Makes plans while everything else goes on, a slice at a time, and says how long starts are held.

A burst is planned as a whole: as long as the next task comes within a moment, and then as long as
the plan becomes noticeably better, its tasks are not given to robots, which would begin at once.
A plan that improves lists holds nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from blackboard.auction.search.planner import ROUND_TIME, Patience, Planner

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.auction.central import Central
    from blackboard.auction.search.planner import Planned
    from blackboard.auction.step import MakePlan
    from blackboard.domain.talker import Talker, Timer

TICK = 0.0125
"""Time between two slices of a plan [s]."""

SLICE = 0.010
"""Processor time of a slice [s]: nothing else in the process waits for longer."""

HOLD = 0.7
"""The tasks of a burst are held for at most this long after the first of them came [s], and until
there is a plan at all."""

MOMENT = 0.05
"""A task that comes within this time after another belongs to the same burst [s]."""

_WORTH_HOLDING = 0.1
"""Starts are held until a plan has not become noticeably better for so long [s]."""

_BESIDE_WORK = Patience(longest=0.4, without_gain=0.15)
"""How long lists are improved that robots are working through."""

_ROUNDS_PER_TASK = 25
"""A plan of a few tasks is done when so many rounds for each of them have found nothing."""


class PlanMaker:
    """Makes one plan at a time.

    Args:
        measure: What plans minimize, a name of `MEASURES`.
        made: Called with each plan.
        again: Called if tasks have come that belong to the burst that is planned.
    """

    def __init__(
        self,
        talker: Talker,
        central: Central,
        measure: str,
        made: Callable[[Planned], None],
        again: Callable[[], None],
    ) -> None:
        self._talker = talker
        self._central = central
        self._measure = measure
        self._made = made
        self._again = again
        self._planner: Planner | None = None
        self._timer: Timer | None = None
        self._held_since: float | None = None
        self._last_came = -MOMENT
        self._has_more = False

    def begin(self, asked: MakePlan) -> None:
        """Begin a plan in place of the one before."""
        self._stop()
        now = self._talker.now()
        patience = _BESIDE_WORK
        if asked.improves:
            self._held_since = None
        else:
            since = self._held_since = now if self._held_since is None else self._held_since
            left = max(0.0, since + HOLD - now)
            patience = Patience(left * SLICE / TICK, _WORTH_HOLDING)
        enough = _ROUNDS_PER_TASK * ROUND_TIME * len(asked.records)
        patience = replace(patience, without_gain=min(patience.without_gain, enough))
        situation = self._central.situation(asked.bases, asked.records)
        self._planner = Planner(situation, self._measure, patience, asked.number)
        self._has_more = False
        self._timer = self._talker.every(TICK, self._tick)

    def note_task(self) -> None:
        """Note that a task has come."""
        self._has_more, self._last_came = True, self._talker.now()

    def stop(self) -> None:
        """Drop the plan."""
        self._stop()
        self._held_since = None

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = self._planner = None

    def _tick(self) -> None:
        if self._planner is None:
            return
        now, since = self._talker.now(), self._held_since
        if self._has_more and since is not None and now - since < HOLD:
            if now - self._last_came >= MOMENT:
                self._stop()
                self._again()
            return
        planned = self._planner.advance(SLICE)
        if planned is not None:
            self.stop()
            self._made(planned)
