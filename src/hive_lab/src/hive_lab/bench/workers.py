# SPDX-License-Identifier: BSD-3-Clause
"""Processes that do the runs of a measurement, one for each processor."""

from __future__ import annotations

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor


@contextmanager
def workers(method: str = "fork") -> Iterator[Executor]:
    """Yield what does runs in processes; whatever ends the block early ends them at once.

    Args:
        method: How Python starts them. A process that is not forked does not find the packages'
            messages: catkin's package files change the module path that it inherits.
    """
    others = set(multiprocessing.active_children())
    context = multiprocessing.get_context(method)
    pool = ProcessPoolExecutor(os.cpu_count(), mp_context=context, initializer=_obey_signals)
    try:
        yield pool
    except BaseException:  # Ctrl-C and signals too
        pool.shutdown(wait=False, cancel_futures=True)
        for each in set(multiprocessing.active_children()) - others:
            each.terminate()
            while each.is_alive():  # `join` returns too early where the pool waits for it as well
                each.join(0.1)
        raise
    pool.shutdown()


def _obey_signals() -> None:
    """End a worker with the signals for which its parent has handlers, which it has inherited."""
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_DFL)
