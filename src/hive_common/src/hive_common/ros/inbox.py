# SPDX-License-Identifier: BSD-3-Clause
"""The queue through which everything from outside reaches a node's main thread.

rospy calls back in threads of its own, but a node's state belongs to its main thread. Callbacks
therefore only put actions into the inbox.

An action that fails is a defect of ours. It ends with an error in the log; the node goes on.
"""

from __future__ import annotations

import concurrent.futures
import queue
import traceback
from typing import TYPE_CHECKING, TypeVar

import rospy

if TYPE_CHECKING:
    from collections.abc import Callable

Answer = TypeVar("Answer")

_AGAIN = 60.0  # time until the same failure is logged again [s]
PATIENCE = 10.0  # time that a caller waits for the main thread [s, wall clock]


class Inbox:
    """Actions for the main loop, in the order in which they came in.

    Attributes:
        failures: How many actions have failed.
    """

    def __init__(self) -> None:
        self.failures = 0
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

        An exception of the question is raised here, too.

        Args:
            question: The main thread calls it.
            otherwise: The answer if the main thread does not answer in time.
            patience: How long it may take [s, wall clock].
        """
        future: concurrent.futures.Future[Answer] = concurrent.futures.Future()

        def answer() -> None:
            try:
                future.set_result(question())
            except Exception as error:
                future.set_exception(error)
                raise

        self.put(answer)
        try:
            return future.result(patience)
        except concurrent.futures.TimeoutError:
            return otherwise

    def empty(self) -> None:
        """Run all actions that have come in; only the main thread calls this."""
        while not self._queue.empty():
            self._run(self._queue.get())

    def wait(self, timeout: float) -> None:
        """Wait up to `timeout` [s, wall clock] for an action, then run all; main thread only."""
        try:
            action = self._queue.get(timeout=timeout)
        except queue.Empty:
            return
        self._run(action)
        self.empty()

    def _run(self, action: Callable[[], object]) -> None:
        try:
            action()
        except rospy.ROSException:
            raise  # the node is being shut down
        except Exception as error:  # noqa: BLE001  (whatever it is, the next message may be good)
            self.failures += 1
            rospy.logerr_throttle_identical(
                _AGAIN, f"what came in could not be handled: {type(error).__name__}: {error}"
            )
            rospy.logdebug(traceback.format_exc())
