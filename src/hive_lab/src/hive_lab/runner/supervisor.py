# SPDX-License-Identifier: BSD-3-Clause
"""Runs a command, and ends every program that it has started and not ended itself.

A test run starts masters, nodes, windows and fork servers, many of them in sessions of their own,
so that neither Ctrl-C nor the end of pytest reaches them. The kernel gives those whose parent has
ended to this process (`PR_SET_CHILD_SUBREAPER`), so whatever is left is found among its
descendants, however it was started.

    python3 -m hive_lab.runner.supervisor COMMAND [ARGUMENT ...]
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import signal
import sys
from typing import TYPE_CHECKING

import psutil

if TYPE_CHECKING:
    from types import FrameType

TIME_TO_REPORT = 15
"""Time that an interrupted command has to end itself and to say how far it came [s]."""

TIME_TO_END = 5.0
"""Time that programs have to end by themselves, and then again after SIGTERM [s]."""

_SET_CHILD_SUBREAPER = 36  # PR_SET_CHILD_SUBREAPER of linux/prctl.h


def main(command: list[str], patience: float = TIME_TO_END) -> int:
    """Run a command, end what it leaves, and return its exit code as a shell tells it.

    Args:
        command: The program and its arguments.
        patience: Time that what is left has to end by itself, and again after SIGTERM [s].

    Raises:
        OSError: The program cannot be started.
    """
    if ctypes.CDLL(None, use_errno=True).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "the kernel does not give up orphans to this process")
    # A shell starts what runs in its background with SIGINT ignored.
    child = os.posix_spawnp(command[0], command, os.environ, setsigdef=[signal.SIGINT])
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
        signal.signal(number, functools.partial(_interrupt, child))
    code = _wait_for(child)
    left = _end_descendants(patience)
    if left:
        sys.stderr.write("".join(f"left running, and ended now: {each}\n" for each in left))
    return code


def _interrupt(child: int, number: int, _frame: FrameType | None) -> None:
    """Have the command end in time.

    Ctrl-C in a terminal reaches the command by itself. Any other signal is passed on as Ctrl-C,
    which pytest answers with a report.
    """
    with contextlib.suppress(ProcessLookupError):
        if number == signal.SIGALRM:
            os.kill(child, signal.SIGKILL)
        elif number != signal.SIGINT:
            os.kill(child, signal.SIGINT)
    signal.alarm(TIME_TO_REPORT)


def _wait_for(pid: int) -> int:
    """Reap whatever ends until the command does; return the command's exit code."""
    while True:
        ended, status = os.waitpid(-1, 0)
        if ended == pid:
            signal.alarm(0)
            code = os.waitstatus_to_exitcode(status)
            return code if code >= 0 else 128 - code


def _end_descendants(patience: float) -> list[str]:
    """End all descendants; return the command lines of those that did not end by themselves."""
    told: list[str] = []
    own = psutil.Process()
    _, alive = psutil.wait_procs(own.children(recursive=True), timeout=patience)
    while alive:  # what ends gives its children to this process
        for end in (psutil.Process.terminate, psutil.Process.kill):
            for process in alive:
                with contextlib.suppress(psutil.NoSuchProcess):
                    if end is psutil.Process.terminate:
                        told.append(" ".join(process.cmdline()) or process.name())
                    end(process)
            _, alive = psutil.wait_procs(alive, timeout=patience)
        alive = own.children(recursive=True)
    return told


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
