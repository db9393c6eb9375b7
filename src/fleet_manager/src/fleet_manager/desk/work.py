# SPDX-License-Identifier: BSD-3-Clause
"""What a link of the windows has to do in a thread of its own."""

from __future__ import annotations

import queue
import time
from threading import Event
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class Work:
    """A queue of actions; any thread may add some, and one thread runs them."""

    def __init__(self) -> None:
        self._actions: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._stopped = Event()

    @property
    def is_stopped(self) -> bool:
        """Whether nothing more has to be done."""
        return self._stopped.is_set()

    def put(self, action: Callable[[], None]) -> None:
        """Add an action."""
        self._actions.put(action)

    def stop(self) -> None:
        """Have nothing more done, and nobody wait for more."""
        self._stopped.set()
        self._actions.put(lambda: None)

    def pause(self, seconds: float) -> None:
        """Wait [s]; less if it is stopped meanwhile."""
        self._stopped.wait(seconds)

    def run_for(self, seconds: float) -> None:
        """Run actions for a while [s], until it is stopped."""
        end = time.monotonic() + seconds
        while not self.is_stopped:
            try:
                self._actions.get(timeout=max(0.0, end - time.monotonic()))()
            except queue.Empty:
                return
