# SPDX-License-Identifier: BSD-3-Clause
"""What hangs on real ROS or in a window ends, by one rule for all tests."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from hive_lab.runner import limits

pytest_plugins = ["pytester"]

TESTS = Path(__file__).resolve().parents[4] / "test"
CASES = """
import pytest

@pytest.fixture
def ready():
    assert {is_ready}

def test_one(ready):
    assert False

def test_two():
    pass
"""


class Clock:
    """A plugin of pytest: every phase of a test has taken as long as it says [s]."""

    def __init__(self, duration):
        self._duration = duration

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_makereport(self):
        outcome = yield
        outcome.get_result().duration = self._duration


@pytest.fixture
def run(pytester):
    """Return a function that runs cases of which each phase takes as long [s]."""

    def run_cases(text, duration):
        pytester.makepyfile(text)
        plugins = [limits, Clock(duration)]
        return pytester.runpytest_inprocess("-p", "no:cacheprovider", plugins=plugins)

    return run_cases


@pytest.mark.parametrize("is_ready", [True, False], ids=["in the case", "in its fixture"])
def test_after_a_case_that_has_hung_no_other_of_its_file_runs(run, is_ready):
    done = run(CASES.format(is_ready=is_ready), limits.PATIENCE)

    assert sum(done.parseoutcomes().get(word, 0) for word in ("failed", "errors")) == 1
    assert "passed" not in done.parseoutcomes()
    done.stdout.fnmatch_lines(["*test_one has hung*"])


def test_after_a_case_that_fails_at_once_the_others_run(run):
    done = run(CASES.format(is_ready=True), limits.PATIENCE - 1.0)

    assert done.parseoutcomes() == {"failed": 1, "passed": 1}


def test_a_wait_ends_before_its_case_and_a_case_before_its_file():
    assert limits.PATIENCE < limits.CASE < limits.FILE


@pytest.mark.parametrize("file", sorted((TESTS / "rostest").glob("*.test")), ids=lambda f: f.stem)
def test_a_file_on_ros_has_the_limit_of_all(file):
    nodes = ET.parse(file).getroot().iter("test")  # noqa: S314  (our own launch files)

    assert {node.get("time-limit") for node in nodes} == {"$(env HIVE_TIME_LIMIT)"}


def test_no_other_file_of_tests_says_how_long_it_waits_for_what_hangs():
    files = [*(TESTS / "rostest").rglob("*.py"), *(TESTS / "gui").rglob("*.py")]
    assert files

    own = re.compile(r"^(PATIENCE|WAIT|HANGS) = \d", re.MULTILINE)
    assert [file for file in files if own.search(file.read_text(encoding="utf-8"))] == []
