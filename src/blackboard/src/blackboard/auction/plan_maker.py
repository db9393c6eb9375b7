# SPDX-License-Identifier: BSD-3-Clause
"""Makes plans while everything else goes on, and says how long starts are held for them.

A burst is planned as a whole: its tasks are not given to robots, which would begin at once, before
no other task has come for a moment and the plan is made. A plan that improves lists holds nothing.
"""

from __future__ import annotations

import traceback
import zlib
from typing import TYPE_CHECKING

from blackboard.auction.search.planned import Planned, planned
from blackboard.auction.search.searcher import Job
from blackboard.auction.search.survey import Surveyed, survey
from blackboard.auction.step import MOMENT
from blackboard.domain.path_lengths import Wanted
from blackboard.domain.task import TaskState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from blackboard.auction.central import Central
    from blackboard.auction.search.searcher import Found, Searcher
    from blackboard.auction.step import MakePlan
    from blackboard.domain.path_lengths import Field
    from blackboard.domain.talker import Talker, Timer

TICK = 0.0125
"""Time between two slices of the work before a search [s]."""

SLICE = 0.010
"""Processor time of a slice [s]: nothing else in the process waits for longer."""

HOLD = 2.0
"""The tasks of a burst are gathered for at most this long after the first of them came [s]."""

LONGEST = 10.0
"""A plan that takes longer than this is not waited for [s]: its tasks are auctioned."""

ROUNDS, ROUNDS_BESIDE_WORK = 200, 50
"""Rounds of the search for each task: for what waits, and for lists that robots work through."""

SEARCH_TIME = 0.5
"""Processor time that a search takes at most [s]."""

SEARCH_SHARE = 0.005
"""And no more than this share of the mean time until a task is done: what is planned waits."""

MOVE = 5.0
"""What it counts to give a task to another robot [s]: a move has to pay, because what is known of
ways and loads is never exact."""


class PlanMaker:
    """Makes one plan at a time.

    Args:
        measure: What plans minimize, a name of `MEASURE_NAMES`.
        searcher: Searches for them.
        made: Called with each plan.
        again: Called if tasks have come that belong to the burst that is planned.
    """

    def __init__(
        self,
        talker: Talker,
        central: Central,
        measure: str,
        searcher: Searcher,
        made: Callable[[Planned], None],
        again: Callable[[], None],
    ) -> None:
        self._talker = talker
        self._central = central
        self._measure = measure
        self._searcher = searcher
        self._made = made
        self._again = again
        self._asked: MakePlan | None = None
        self._work: Iterator[float | Wanted | Surveyed] | None = None
        self._wanted: Wanted | None = None  # what the searcher computes now
        self._surveyed: Surveyed | None = None
        self._timer: Timer | None = None
        self._begun_at = 0.0
        self._held_since: float | None = None
        self._held: frozenset[str] = frozenset()  # the tasks whose starts are held
        self._last_came = -MOMENT
        self._has_more = self._has_gathered = self._has_failed = False

    def lead(self) -> None:
        """Get ready: this member leads now."""
        self._searcher.start()

    def begin(self, asked: MakePlan) -> None:
        """Begin a plan in place of the one before."""
        self.drop()
        self._begun_at = self._talker.now()
        held = frozenset(
            record.task.id for record in asked.records if record.state is TaskState.WAITING
        )
        if asked.improves:
            self._held_since = None
        elif self._held_since is None or not held & self._held:
            self._held_since, self._has_gathered = self._begun_at, False
        self._held = held
        self._asked = asked
        self._has_more = False
        self._timer = self._talker.every(TICK, self._tick)
        self._tick()

    def note_task(self) -> None:
        """Note that a task has come."""
        self._has_more, self._last_came = True, self._talker.now()

    def retire(self) -> None:
        """Drop the plan: this member does not lead any more."""
        self.drop()
        self._searcher.stop()

    def drop(self) -> None:
        """Drop the plan; the next one may be for the same burst."""
        if self._timer is not None:
            self._timer.cancel()
        if self._asked is not None:
            self._searcher.drop()
        self._timer = self._asked = self._work = self._wanted = self._surveyed = None

    def _tick(self) -> None:
        """Wait for the end of the burst, then work for a slice."""
        asked, now, since = self._asked, self._talker.now(), self._held_since
        if asked is None:
            return
        if since is not None and not self._has_gathered:
            is_over = now - since >= HOLD
            if not is_over and now - self._last_came < MOMENT:
                return
            if self._has_more:
                self._has_gathered = is_over  # whatever comes now is for the next plan
                self.drop()
                self._again()
                return
        if now - self._begun_at > LONGEST:
            self._searcher.stop()
            self._found(None)
        elif self._surveyed is None and self._wanted is None:
            self._survey(asked)

    def _survey(self, asked: MakePlan) -> None:
        """Work for a slice, or ask for what another process is to do."""
        try:
            piece = self._slice(asked)
        except Exception:  # noqa: BLE001  (whatever it is, what a robot tells must not end a leader)
            self._fail(asked, traceback.format_exc())
            return
        if isinstance(piece, Surveyed):
            self._surveyed = piece
            self._searcher.search(self._job(asked, piece), self._found)
        elif isinstance(piece, Wanted):
            self._wanted = piece
            self._searcher.fields(piece.job, self._go_on)
        elif piece is None:
            self._end(Planned(left=asked.records))

    def _slice(self, asked: MakePlan) -> float | Wanted | Surveyed | None:
        """Return what came last, or None if there is nothing to be planned."""
        if self._work is None:
            self._work = survey(self._central.situation(asked.bases, asked.records))
        spent = 0.0
        for piece in self._work:
            if not isinstance(piece, float):
                return piece
            spent += piece
            if spent >= SLICE:
                return spent
        return None

    def _go_on(self, fields: Sequence[Field] | None) -> None:
        """Go on with a survey, also without the fields, which it then makes itself."""
        wanted, self._wanted = self._wanted, None
        if wanted is not None and fields is not None:
            wanted.keep(fields)
        self._tick()

    def _job(self, asked: MakePlan, surveyed: Surveyed) -> Job:
        rounds = ROUNDS_BESIDE_WORK if asked.improves else ROUNDS
        return Job(
            surveyed.problem,
            surveyed.plan,
            self._measure,
            MOVE,
            zlib.crc32(repr(asked.number).encode()),
            rounds * len(surveyed.records),
            SEARCH_TIME,
            SEARCH_SHARE,
        )

    def _found(self, found: Found | None) -> None:
        asked, surveyed = self._asked, self._surveyed
        if asked is None:
            return
        if found is None or surveyed is None:
            self._fail(asked)
            return
        try:
            plan = planned(surveyed, found, self._measure)
        except Exception:  # noqa: BLE001  (as in `_survey`)
            self._fail(asked, traceback.format_exc())
            return
        self._has_failed = False
        self._end(plan)

    def _fail(self, asked: MakePlan, why: str = "") -> None:
        """Leave everything to auctions, and say so once."""
        if not self._has_failed:
            self._has_failed = True
            self._talker.warn(
                "the search for a plan has failed; tasks are auctioned one by one, and the next "
                "burst is planned again" + f"\n{why}" * bool(why)
            )
        self._end(Planned(left=asked.records))

    def _end(self, plan: Planned) -> None:
        self.drop()
        self._held_since = None
        self._made(plan)
