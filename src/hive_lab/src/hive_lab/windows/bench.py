# SPDX-License-Identifier: BSD-3-Clause
"""Measures the longest stall of the windows, and their CPU time and memory.

A fake fleet with 2,000 tasks and 50 robots speaks on a ROS master of its own; the fleet window
follows it in a process of its own, without a screen where there is none.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fleet_manager.demo.machine import reserved_port, screen_is_usable
from hive_lab.bench.registry import BenchResult
from hive_lab.bench.usage import usage_of
from hive_lab.windows import fake_fleet_node, measured_window

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

TASKS, ROBOTS, QUIET, BUSY = 2000, 50, 0, 500
PHASE = 5.0  # [s] for each case
PATIENCE = 120.0  # [s], the longest wait for anything to start
AIMS = {
    "stall, filled with 2000 tasks [s]": 0.1,
    "stall, 500 messages a second [s]": 0.1,
    "stall, scrolling through 2000 tasks [s]": 0.1,
    "stall, blackboard gone [s]": 0.1,
    "stall, ROS master gone [s]": 0.1,
}


class BenchError(Exception):
    """Something that is measured did not start."""


class Window:
    """A fleet window in its own process; `longest` is the stall in the last `wait_for` [s]."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.longest = 0.0

    def ask(self, word: str = "") -> dict[str, Any]:
        """Return what the window shows, and restart its measurement."""
        assert self.process.stdin  # noqa: S101  (it was started with one)
        self.process.stdin.write(f"{word}\n")
        self.process.stdin.flush()
        answer: dict[str, Any] = json.loads(self.read())
        return answer

    def read(self) -> str:
        """Return the next line of the window's output."""
        assert self.process.stdout  # noqa: S101  (it was started with one)
        line = self.process.stdout.readline()
        if not line:
            raise BenchError("the window ended unexpectedly")
        return line.strip()

    def wait_for(self, **wanted: object) -> None:
        """Wait until the window shows some values."""
        end, self.longest = time.monotonic() + PATIENCE, 0.0
        while True:
            told = self.ask()
            self.longest = max(self.longest, told["stall"])
            if wanted.items() <= told.items():
                return
            if time.monotonic() > end:
                raise BenchError(f"the window shows {told} instead of {wanted}")
            time.sleep(0.1)

    def stall(self, word: str = "") -> float:
        """Watch for a phase and return the longest stall [s]."""
        self.ask(word)
        time.sleep(PHASE)
        return float(self.ask()["stall"])


def run() -> BenchResult:
    """Measure everything; it takes about a minute."""
    figures: dict[str, float] = {}
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        port = stack.enter_context(reserved_port())
        environment = _environment(port, folder)
        master = stack.enter_context(_process(["roscore", "-p", str(port)], environment))
        begin = time.monotonic()
        window = Window(stack.enter_context(_window(environment, folder)))
        window.read()
        figures["start until shown [s]"] = time.monotonic() - begin
        window.wait_for(link="UP")
        with _fake_fleet(environment, QUIET):
            figures |= _quiet(window)
        figures["stall, blackboard gone [s]"] = window.stall()
        window.wait_for(standing="SILENT")
        with _fake_fleet(environment, BUSY):
            figures |= _busy(window)
        _end(master)
        figures["stall, ROS master gone [s]"] = window.stall()
        window.wait_for(link="LOST")
    return BenchResult(figures, dict(AIMS))


def _quiet(window: Window) -> dict[str, float]:
    """Measure with a long task list that does not change."""
    window.ask()
    window.wait_for(standing="LEADER", tasks=TASKS, robots=ROBOTS)
    filled = window.longest
    share, memory = _usage(window)
    return {
        "stall, filled with 2000 tasks [s]": filled,
        "CPU, idle with 2000 tasks and 50 robots [s/s]": share,
        "memory with 2000 tasks and 50 robots [MB]": memory,
        "stall, scrolling through 2000 tasks [s]": window.stall("scroll"),
    }


def _busy(window: Window) -> dict[str, float]:
    """Measure while 500 messages a second arrive."""
    window.wait_for(standing="LEADER", tasks=TASKS, robots=ROBOTS)
    share, _memory = _usage(window)
    return {
        "stall, 500 messages a second [s]": window.stall(),
        "CPU, 500 messages a second [s/s]": share,
    }


def _usage(window: Window) -> tuple[float, float]:
    """Return the window's CPU seconds per second and its memory [MB]."""
    pid = window.process.pid
    before, begin = usage_of([pid])[pid], time.monotonic()
    time.sleep(PHASE)
    after, passed = usage_of([pid])[pid], time.monotonic() - begin
    return (after.cpu - before.cpu) / passed, after.memory / 1e6


def _environment(port: int, folder: Path) -> dict[str, str]:
    screen = {} if screen_is_usable() else {"QT_QPA_PLATFORM": "offscreen"}
    uri = f"http://127.0.0.1:{port}"
    mine = {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": str(folder / "log")}
    return {**os.environ, **mine, **screen}


def _fake_fleet(environment: Mapping[str, str], rate: int) -> AbstractContextManager[object]:
    """Return a fake fleet that sends `rate` messages a second."""
    words = [str(TASKS), str(ROBOTS), str(rate)]
    return _process([sys.executable, "-m", fake_fleet_node.__name__, *words], environment)


def _window(
    environment: Mapping[str, str], folder: Path
) -> AbstractContextManager[subprocess.Popen[str]]:
    program = [sys.executable, "-m", measured_window.__name__]
    return _process([*program, str(folder / "settings.ini")], environment, stdout=subprocess.PIPE)


@contextmanager
def _process(
    command: Sequence[str], environment: Mapping[str, str], stdout: int = subprocess.DEVNULL
) -> Iterator[subprocess.Popen[str]]:
    """Run a program while the context lasts."""
    process = subprocess.Popen(  # noqa: S603  (named above)
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=stdout,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        _end(process)


def _end(process: subprocess.Popen[str]) -> None:
    """End a program and its descendants."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    for stream in (process.stdin, process.stdout):
        if stream:
            stream.close()
