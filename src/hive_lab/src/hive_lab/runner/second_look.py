# SPDX-License-Identifier: BSD-3-Clause
"""What fails on real ROS or in a window is run once more, alone, after all other tests.

Real nodes share a machine with whatever else runs there. A machine that stands still for some
seconds can fail a test of theirs, though nothing is wrong with the program. If the test passes
when it has the machine to itself, it counts as passed, and the run names it as flaky. All other
levels are deterministic, so nothing of theirs is repeated.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from hive_lab.runner.times import level_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from _pytest.terminal import TerminalReporter  # pytest 7 does not export it

LEVELS = ("rostest", "gui")
"""Levels whose tests get a second look."""

MOST = 3
"""So many files may be flaky. If more fail, the run fails anyway, and none of them runs again."""

_AGAIN = "look again"  # the outcome of a failure that is not final

Reports = list[pytest.TestReport]


class SecondLook:
    """Holds failures back until the other tests have run, and then looks again.

    Args:
        run: Runs a test alone, and returns its reports.
        flaky: The file to which flaky tests are appended.
    """

    def __init__(self, run: Callable[[str], Reports], flaky: Path) -> None:
        self._run = run
        self._file = flaky
        self._first: dict[str, Reports] = {}  # the failures held back, by test
        self._flaky: dict[str, pytest.TestReport] = {}
        self._is_over = False

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Hold a failure back."""
        if report.failed and not self._is_over and level_of(report.nodeid) in LEVELS:
            self._first.setdefault(_name_of(report.nodeid), []).append(report)
            report.outcome = _AGAIN  # type: ignore[assignment]  # pytest asks us what this means

    @pytest.hookimpl(tryfirst=True)
    def pytest_report_teststatus(
        self, report: pytest.TestReport
    ) -> tuple[str, str, tuple[str, dict[str, bool]]] | None:
        """Show a failure that is held back, without counting it."""
        if report.outcome == _AGAIN:
            return "", "a", ("AGAIN LATER", {"yellow": True})
        return None

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtestloop(self, session: pytest.Session) -> Iterator[None]:
        """Look again when all tests have run; after an interruption the failures count."""
        outcome = yield
        self._is_over = True
        files = {test.partition("::")[0] for test in self._first}
        looks_again = outcome.excinfo is None and len(files) <= MOST  # type: ignore[attr-defined]  # pluggy's
        for test, failures in self._first.items():
            for report in self._verdict(test, failures) if looks_again else _final(failures):
                session.config.hook.pytest_runtest_logreport(report=report)

    def _verdict(self, test: str, failures: Reports) -> Reports:
        """Run a test again; return the reports that count."""
        reports = self._run(test)
        if not reports or any(report.failed for report in reports):
            for report in reports:
                if report.failed:
                    report.sections.append(("first failure", failures[0].longreprtext))
            return reports or _final(failures)
        self._flaky[test] = failures[0]
        return reports

    def pytest_terminal_summary(self, terminalreporter: TerminalReporter) -> None:
        """Name the flaky tests with the reasons of their first failures, and write them down."""
        if not self._flaky:
            return
        terminalreporter.section("flaky: failed beside other tests, passed alone", yellow=True)
        lines = [
            f"{test}: {_place(test, report)}{_reason(report)}"
            for test, report in self._flaky.items()
        ]
        for line in lines:
            terminalreporter.line(line)
        terminalreporter.stats["flaky"] = list(self._flaky.values())
        # pytest 8 has looked already which kinds its last line is to count.
        terminalreporter._set_main_color()  # noqa: SLF001  (pytest has no other way)
        self._file.parent.mkdir(exist_ok=True)
        with self._file.open("a", encoding="utf-8") as file:
            now = datetime.now().astimezone().isoformat(timespec="seconds")
            file.writelines(f"{now} {line}\n" for line in lines)


def run_alone(config: pytest.Config, test: str, plugin: str) -> Reports:
    """Run one test in a pytest of its own, in which a plugin writes its reports; return them."""
    results = config.getoption("--results", default=None) if level_of(test) == "rostest" else None
    with tempfile.TemporaryDirectory(prefix="second-look-") as folder:
        reports = Path(folder) / "reports"
        command = [
            *(sys.executable, "-m", "pytest", "-c", str(config.inipath), "-o", "pythonpath="),
            *("-p", plugin, "--reports", str(reports)),
            *(("--results", str(results)) if results else ()),
            str(config.rootpath / test),
        ]
        subprocess.run(  # noqa: S603  (our own tests)
            command,
            cwd=config.rootpath,
            env=dict(os.environ),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
        if not reports.is_file():
            return []
        return [
            config.hook.pytest_report_from_serializable(config=config, data=json.loads(line))
            for line in reports.read_text(encoding="utf-8").splitlines()
        ]


def _name_of(node: str) -> str:
    """Return a test's name without the group that pytest-xdist appends to it."""
    return re.sub(r"@[\w-]+$", "", node)


def _final(failures: Sequence[pytest.TestReport]) -> Reports:
    for report in failures:
        report.outcome = "failed"
    return list(failures)


def _place(test: str, report: pytest.TestReport) -> str:
    """Return the last line of the test's own file that a failure went through, in words."""
    file = re.escape(test.partition("::")[0])
    found = re.findall(rf"^{file}:(\d+): ", report.longreprtext, flags=re.MULTILINE)
    return f"line {found[-1]}: " if found else ""


def _reason(report: pytest.TestReport) -> str:
    """Return the line that says most about a failure."""
    lines = [line.strip() for line in report.longreprtext.splitlines() if line.strip()]
    marked = [line.removeprefix("E").strip() for line in lines if line.startswith("E ")]
    return (marked or lines or ["no reason was told"])[0]
