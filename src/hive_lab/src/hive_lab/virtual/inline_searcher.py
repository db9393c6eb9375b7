# SPDX-License-Identifier: BSD-3-Clause
"""Searches for the plans of hives on virtual time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.auction.search.ruin_recreate import search

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.auction.search.searcher import Found, Job
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
        self._number += 1
        number, found = self._number, search(job)
        self._clock.after(found.spent, lambda: done(found) if number == self._number else None)

    def drop(self) -> None:
        """See `Searcher.drop`."""
        self._number += 1

    def stop(self) -> None:
        """See `Searcher.stop`."""
        self.drop()
