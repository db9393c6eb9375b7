# SPDX-License-Identifier: BSD-3-Clause
"""How much of what each process says may wait to be read, so that none holds up the others."""

from __future__ import annotations

import threading
from collections import Counter

MOST = 1000
"""Messages of one process that may wait. A member reads several thousand in a second, and says a
hundred at most; a program that posts a thousand tasks at once has to ask again for those that were
dropped, as for any message that is lost."""


class Backlog:
    """Counts the messages that wait, by who has said them. Any thread may use it.

    Args:
        most: So many messages of one process may wait.
    """

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self._waiting: Counter[str] = Counter()
        self._dropped: dict[str, Counter[str]] = {}
        self._lock = threading.Lock()

    def admits(self, sender: str, topic: str) -> bool:
        """Return whether a message on a topic may wait; if not, it is dropped."""
        with self._lock:
            if self._waiting[sender] >= self._most:
                self._dropped.setdefault(sender, Counter())[topic] += 1
                return False
            self._waiting[sender] += 1
            return True

    def leaves(self, sender: str) -> dict[str, int]:
        """Note that a message waits no more; return how many of its sender's were dropped.

        They are counted by topic, since the last time.
        """
        with self._lock:
            self._waiting[sender] -= 1
            if not self._waiting[sender]:
                del self._waiting[sender]
            return self._dropped.pop(sender, {})
