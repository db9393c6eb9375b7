# SPDX-License-Identifier: BSD-3-Clause
"""Where the time of a test run goes: minutes per level, and the slowest tests."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest
    from _pytest.terminal import TerminalReporter  # pytest 7 does not export it

LEVELS = ("rostest", "gui", "hive")
"""Folders of `test/` that are a level; every other test is of the level `unit`."""

_SLOWEST = 10


def level_of(test: str) -> str:
    """Return the level of a test, given as pytest names it."""
    top, _, below = test.partition("/")
    folder = below.partition("/")[0]
    return folder if top == "test" and folder in LEVELS else "unit"


class Times:
    """Adds up how long tests take, set-up and teardown included, and tells at the end."""

    def __init__(self) -> None:
        self._seconds: Counter[str] = Counter()  # by test

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note how long a part of a test took."""
        self._seconds[report.nodeid] += report.duration  # type: ignore[assignment]  # a Counter of floats adds up too

    def pytest_terminal_summary(self, terminalreporter: TerminalReporter) -> None:
        """Tell the minutes of each level, summed over the workers, and the slowest tests."""
        levels: Counter[str] = Counter()
        for test, seconds in self._seconds.items():
            levels[level_of(test)] += seconds
        if not levels:
            return
        terminalreporter.section("time")
        told = (f"{level} {seconds / 60:.1f}" for level, seconds in levels.most_common())
        terminalreporter.line(f"minutes per level, summed over the workers: {', '.join(told)}")
        terminalreporter.line("slowest tests:")
        for test, seconds in self._seconds.most_common(_SLOWEST):
            terminalreporter.line(f"{seconds:7.1f} s  {test}")
