# SPDX-License-Identifier: BSD-3-Clause
"""Where facts wait until the windows have time for them."""

from __future__ import annotations

import itertools
from collections import OrderedDict
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable

    from fleet_manager.desk.facts import Fact

LONGEST = 20_000  # facts; more would not be read before they are of no use


class Inbox:
    """A queue between the threads of ROS and the event loop of the windows.

    What is superseded by something newer, such as a robot's report by its next one, waits only
    once. When too much waits the oldest is dropped: the next task list tells what it said.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._numbers = itertools.count()
        self._facts: OrderedDict[Hashable, Fact] = OrderedDict()

    def put(self, fact: Fact, supersedes: Hashable = None) -> None:
        """Add a fact at the end.

        Args:
            fact: What has arrived.
            supersedes: Name of what this is the newest of; an older fact of the same name that
                still waits is dropped. None for a fact that counts for itself.
        """
        with self._lock:
            if supersedes is None:
                supersedes = next(self._numbers)
            else:
                self._facts.pop(supersedes, None)
            self._facts[supersedes] = fact
            if len(self._facts) > LONGEST:
                self._facts.popitem(last=False)

    def take(self, limit: int) -> list[Fact]:
        """Return at most `limit` facts, the oldest first, and drop them here."""
        with self._lock:
            count = min(limit, len(self._facts))
            return [self._facts.popitem(last=False)[1] for _fact in range(count)]
