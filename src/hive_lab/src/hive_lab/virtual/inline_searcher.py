# SPDX-License-Identifier: BSD-3-Clause
"""Searches for the plans of hives on virtual time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from blackboard.auction.search.fields import fields, time_for
from blackboard.auction.search.ruin_recreate import search

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from blackboard.auction.search.searcher import Found, Job
    from blackboard.domain.path_lengths import Field, FieldJob
    from blackboard.domain.talker import Clock


class InlineSearcher:
    """A `Searcher` in this process: the search takes the time that it counts."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._number = 0

    def start(self) -> None:
        """See `Searcher.start`."""

    def search(self, job: Job, done: Callable[[Found | None], None]) -> None:
        """See `Searcher.search`."""
        found = search(job)
        self._tell(found.spent, done, found)

    def fields(self, job: FieldJob, done: Callable[[Sequence[Field] | None], None]) -> None:
        """See `Searcher.fields`."""
        self._tell(time_for(job), done, list(fields(job)))

    def drop(self) -> None:
        """See `Searcher.drop`."""
        self._number += 1

    def stop(self) -> None:
        """See `Searcher.stop`."""
        self.drop()

    def _tell(self, spent: float, done: Callable[[Any], None], found: object) -> None:
        self._number += 1
        number = self._number
        self._clock.after(spent, lambda: done(found) if number == self._number else None)
