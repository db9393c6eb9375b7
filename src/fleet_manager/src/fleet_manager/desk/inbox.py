# SPDX-License-Identifier: BSD-3-Clause
"""The queue of facts between the threads of a link and the windows."""

from __future__ import annotations

import itertools
from collections import OrderedDict
from threading import Lock
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Hashable

    from fleet_manager.desk.facts import Fact

MAX_FACTS = 20_000  # more would be useless by the time they are read


class FactSink(Protocol):
    """Takes in facts from a link's threads; see `Inbox.put`."""

    def __call__(self, fact: Fact, supersedes: Hashable = None, /) -> None:
        """Take in a fact, which replaces an older one of the same name."""


class Inbox:
    """A queue in which a newer fact replaces an older one of the same name.

    So a robot's report waits only once. When too many facts wait, the oldest is dropped: the next
    task list tells what it said.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = itertools.count()
        self._facts: OrderedDict[Hashable, Fact] = OrderedDict()

    def put(self, fact: Fact, supersedes: Hashable = None) -> None:
        """Add a fact at the end.

        An older fact named `supersedes` that still waits is dropped; None drops nothing.
        """
        with self._lock:
            if supersedes is None:
                supersedes = next(self._numbers)
            else:
                self._facts.pop(supersedes, None)
            self._facts[supersedes] = fact
            if len(self._facts) > MAX_FACTS:
                self._facts.popitem(last=False)

    def take(self, limit: int) -> list[Fact]:
        """Remove and return at most `limit` facts, oldest first."""
        with self._lock:
            count = min(limit, len(self._facts))
            return [self._facts.popitem(last=False)[1] for _fact in range(count)]
