# SPDX-License-Identifier: BSD-3-Clause
"""Tells the process that has started a traffic planner how far it is with being loaded.

On a busy machine that takes minutes; without a word, a planner is taken to be stuck and ended. It
goes through a pipe, so it works before this process is a node. This module imports nothing of the
planner (see `traffic_ears`).
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

OPTION = "--progress="
"""Before the number of the pipe, among the arguments of the process."""

PERIOD = 1.0
"""Time between two words on a step that takes long [s, wall clock]."""


class ProgressTeller:
    """Tells what a planner does, in words that follow "it", such as "waits for the map"."""

    def __init__(self, arguments: Sequence[str]) -> None:
        """Find the pipe in the arguments of the process; without one, nobody is told."""
        numbers = [word.removeprefix(OPTION) for word in arguments if word.startswith(OPTION)]
        self._pipe = int(numbers[0]) if numbers and numbers[0].isdigit() else None
        self._due = 0.0
        if self._pipe is not None:
            os.set_blocking(self._pipe, False)

    def say(self, doing: str) -> None:
        """Tell that a step is done, and what comes now."""
        self._due = time.monotonic() + PERIOD
        if self._pipe is not None:
            with contextlib.suppress(OSError):  # full, or nobody reads it any more
                os.write(self._pipe, f"{doing}\n".encode())

    def go_on(self, doing: str) -> None:
        """Tell that a step goes on; call it as often as you like."""
        if time.monotonic() >= self._due:
            self.say(doing)

    @contextlib.contextmanager
    def counting(self, doing: str, count: Callable[[], int]) -> Iterator[None]:
        """Tell what is done within, with a count, whenever that has changed."""
        ended = threading.Event()

        def watch() -> None:
            before = -1
            while not ended.wait(PERIOD):
                now = count()
                if now != before:
                    before = now
                    self.say(f"{doing} ({now} so far)")

        self.say(doing)
        thread = threading.Thread(target=watch, name="progress", daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()
