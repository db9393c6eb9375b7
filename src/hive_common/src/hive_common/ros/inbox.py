# SPDX-License-Identifier: BSD-3-Clause
"""The one queue through which everything from outside reaches a node's main thread.

rospy calls back in a thread of its own for every topic and service; what they tell belongs to the
main thread alone. Callbacks therefore only put into the inbox what is to be done.
"""

from __future__ import annotations

import concurrent.futures
import queue
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

Answer = TypeVar("Answer")

PATIENCE = 10.0
"""How long a caller waits for the main thread [s, wall clock]."""


class Inbox:
    """What is to be done between two rounds of the main loop, in the order in which it came in."""

    def __init__(self) -> None:
        # Not a SimpleQueue: in Python 3.11 its get() waits for ever, whatever the timeout, once a
        # signal handler has taken longer than that, and rospy's does when it shuts a node down.
        self._queue: queue.Queue[Callable[[], object]] = queue.Queue()

    def put(self, action: Callable[[], object]) -> None:
        """Have something done by the main thread; any thread may call this."""
        self._queue.put(action)

    def ask(
        self, question: Callable[[], Answer], otherwise: Answer, patience: float = PATIENCE
    ) -> Answer:
        """Have the main thread answer a question.

        Any thread but the main one may call this.

        Args:
            question: What the main thread calls.
            otherwise: The answer if the main thread does not come to it in time.
            patience: How long it may take [s, wall clock].
        """
        future: concurrent.futures.Future[Answer] = concurrent.futures.Future()
        self.put(lambda: future.set_result(question()))
        try:
            return future.result(patience)
        except concurrent.futures.TimeoutError:
            return otherwise

    def empty(self) -> None:
        """Do everything that has come in; only the main thread calls this."""
        while not self._queue.empty():
            self._queue.get()()

    def wait(self, timeout: float) -> None:
        """Do what comes in next and all that came with it; only the main thread calls this.

        Args:
            timeout: How long to wait for something to come in [s, wall clock].
        """
        try:
            action = self._queue.get(timeout=timeout)
        except queue.Empty:
            return
        action()
        self.empty()
