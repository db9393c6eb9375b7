# SPDX-License-Identifier: BSD-3-Clause
"""The pytest plugin of `./hive test` for whole levels.

It works in the process that collects the reports, not in the workers of pytest-xdist.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from hive_lab.runner.second_look import SecondLook, run_alone
from hive_lab.runner.times import Times

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what `./hive test` passes on, and what the second look does."""
    group = parser.getgroup("hive")
    group.addoption(
        "--second-look",
        action="store_true",
        help="run what fails on real ROS or in a window once more, alone, after all others",
    )
    group.addoption(
        "--reports", type=Path, metavar="FILE", help="write all reports to FILE, one a line"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register what the options ask for."""
    if hasattr(config, "workerinput"):
        return
    config.pluginmanager.register(Times())
    reports = config.getoption("--reports")
    if reports is not None:
        config.pluginmanager.register(_ReportWriter(config, reports))
    # Who wants to stop at the first failure wants to see it at once.
    if config.getoption("--second-look") and not config.getoption("maxfail"):
        flaky = config.rootpath / "results" / "flaky.txt"
        look = SecondLook(lambda test: run_alone(config, test, plugin=__name__), flaky)
        config.pluginmanager.register(look)


class _ReportWriter:
    """Writes reports where the run that asks for a second look reads them."""

    def __init__(self, config: pytest.Config, file: Path) -> None:
        self._config = config
        self._file = file

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Append a report."""
        data: Mapping[str, object] = self._config.hook.pytest_report_to_serializable(
            config=self._config, report=report
        )
        with self._file.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(data, default=str) + "\n")
