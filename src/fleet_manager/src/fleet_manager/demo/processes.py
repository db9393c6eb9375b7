# SPDX-License-Identifier: BSD-3-Clause
"""Starts the processes of a hive, and ends every one of them whatever happens.

roslaunch gives each node a process group of its own, and a killed roslaunch leaves its nodes
behind. So every process started here has a mark in its environment, which its descendants inherit,
and the end of a run looks for the mark.
"""

from __future__ import annotations

import os
import secrets
import signal
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_MARK = "ROBO_HIVE_RUN"
_PATIENCE = 12.0  # time for processes to end after SIGINT [s]; most need under one

_ENDINGS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_LOOK_EVERY = 0.1
_KILL_TRIES = 50


class ProcessGroup:
    """Processes that end together; each writes to `NAME.log` in `folder`, made where missing."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self.folder = folder
        self._mark = secrets.token_hex(8)
        self._environment = {**environment, _MARK: self._mark}
        self._started: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, command: Sequence[str]) -> None:
        """Start a program in a session of its own, so that Ctrl-C does not reach it directly."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with self.log(name).open("wb") as log:
            self._started[name] = subprocess.Popen(  # noqa: S603  (the caller's own words)
                command,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def log(self, name: str) -> Path:
        """Return the file with the output of a process."""
        return self.folder / f"{name}.log"

    def ended(self) -> str | None:
        """Return the name of a process that ended unexpectedly, or None."""
        return next((name for name, p in self._started.items() if p.poll() is not None), None)

    def members(self) -> list[int]:
        """Return the ids of all processes started here, and of their descendants."""
        mark = f"{_MARK}={self._mark}".encode()
        return [pid for pid in _all_processes() if mark in _environ(pid)]

    def stop(self) -> None:
        """End all processes: SIGINT in reverse order of their start, then SIGKILL.

        A second Ctrl-C is ignored meanwhile, because it would leave processes behind.
        """
        before = {s: signal.signal(s, signal.SIG_IGN) for s in _ENDINGS}
        try:
            for process in reversed(self._started.values()):
                self._interrupt(process)
            for _ in range(_KILL_TRIES):
                members = self.members()
                if not members:
                    break
                for pid in members:
                    _send(pid, signal.SIGKILL)
                time.sleep(_LOOK_EVERY)
            for process in self._started.values():
                process.wait()
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _interrupt(self, process: subprocess.Popen[bytes]) -> None:
        """Ask a process to end, and kill it after `_PATIENCE`."""
        if process.poll() is not None:
            return
        process.send_signal(signal.SIGINT)
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()


def _all_processes() -> list[int]:
    return [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit()]


def _environ(pid: int) -> list[bytes]:
    """Return the environment of a process; empty where it has ended."""
    try:
        return Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return []


def _send(pid: int, number: signal.Signals) -> None:
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return
