# SPDX-License-Identifier: BSD-3-Clause
"""Does what may take long beside the event loop, so that no window stalls."""

from __future__ import annotations

import contextlib
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, TypeVar

from python_qt_binding.QtCore import QObject, Qt, Signal

if TYPE_CHECKING:
    from collections.abc import Callable
    from concurrent.futures import Future

    from python_qt_binding.QtWidgets import QWidget

T = TypeVar("T")


class Background(QObject):
    """A thread that does one thing after the other; the event loop is told when each is done.

    Args:
        parent: Whose work it does; with it, this object is deleted.
    """

    _done = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._thread = ThreadPoolExecutor(1)
        self._asked: deque[tuple[Future[Any], Callable[[Future[Any]], None]]] = deque()
        self._done.connect(self._tell, Qt.QueuedConnection)

    def do(self, work: Callable[[], T], then: Callable[[Future[T]], None]) -> None:
        """Do something in the thread, which must not touch widgets.

        Args:
            work: What is done.
            then: Called in the event loop, with what came of it.
        """
        future = self._thread.submit(work)
        self._asked.append((future, then))
        future.add_done_callback(self._wake)

    def forget(self) -> None:
        """Leave out what has not begun, and tell nothing of what was asked until now."""
        for future, _ in self._asked:
            future.cancel()
        self._asked.clear()

    def _wake(self, _: Future[Any]) -> None:
        with contextlib.suppress(RuntimeError):  # the window is gone
            self._done.emit()

    def _tell(self) -> None:
        while self._asked and self._asked[0][0].done():
            future, then = self._asked.popleft()
            then(future)
