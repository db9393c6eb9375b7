# SPDX-License-Identifier: BSD-3-Clause
"""The queue through which everything from outside reaches a node's main thread.

rospy calls back in threads of its own, but a node's state belongs to its main thread. Callbacks
therefore only put actions into the inbox.
"""

from __future__ import annotations

import concurrent.futures
import queue
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

Answer = TypeVar("Answer")

PATIENCE = 10.0  # time that a caller waits for the main thread [s, wall clock]


class Inbox:
    """Actions for the main loop, in the order in which they came in."""

    def __init__(self) -> None:
        # Not a SimpleQueue: in Python 3.11 its get() never times out once a signal handler has
        # taken longer than the timeout, as rospy's does when it shuts a node down.
        self._queue: queue.Queue[Callable[[], object]] = queue.Queue()

    def put(self, action: Callable[[], object]) -> None:
        """Let the main thread run an action; any thread may call this."""
        self._queue.put(action)

    def ask(
        self, question: Callable[[], Answer], otherwise: Answer, patience: float = PATIENCE
    ) -> Answer:
        """Let the main thread answer a question; any other thread may call this.

        Args:
            question: The main thread calls it.
            otherwise: The answer if the main thread does not answer in time.
            patience: How long it may take [s, wall clock].
        """
        future: concurrent.futures.Future[Answer] = concurrent.futures.Future()
        self.put(lambda: future.set_result(question()))
        try:
            return future.result(patience)
        except concurrent.futures.TimeoutError:
            return otherwise

    def empty(self) -> None:
        """Run all actions that have come in; only the main thread calls this."""
        while not self._queue.empty():
            self._queue.get()()

    def wait(self, timeout: float) -> None:
        """Wait up to `timeout` [s, wall clock] for an action, then run all; main thread only."""
        try:
            action = self._queue.get(timeout=timeout)
        except queue.Empty:
            return
        action()
        self.empty()
