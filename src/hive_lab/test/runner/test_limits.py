# SPDX-License-Identifier: BSD-3-Clause
"""What hangs on real ROS or in a window ends, by one rule for all tests."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from hive_lab.runner import limits

pytest_plugins = ["pytester"]

TESTS = Path(__file__).resolve().parents[4] / "test"
HANGS = """
import time
import pytest

{hangs}

def test_one():
    {one}

def test_two():
    pass
"""
CASES = {
    "case": HANGS.format(hangs="", one="assert time.sleep(0.01)"),
    "fixture": HANGS.format(
        hangs="@pytest.fixture(autouse=True)\ndef hangs():\n    assert time.sleep(0.01)",
        one="pass",
    ),
    "limit": HANGS.format(hangs="pytestmark = pytest.mark.timeout(0.1)", one="time.sleep(9)"),
}


@pytest.fixture
def run(pytester, monkeypatch):
    """Return a function that runs cases, with a patience [s], and returns the outcomes."""

    def run_cases(text, patience):
        monkeypatch.setattr(limits, "PATIENCE", patience)
        pytester.makepyfile(text)
        return pytester.runpytest_inprocess("-p", "no:cacheprovider", plugins=[limits])

    return run_cases


@pytest.mark.parametrize("text", CASES.values(), ids=CASES)
def test_after_a_case_that_has_hung_no_other_of_its_file_runs(run, text):
    done = run(text, patience=0.01)

    assert sum(done.parseoutcomes().get(word, 0) for word in ("failed", "errors")) == 1
    assert "passed" not in done.parseoutcomes()
    done.stdout.fnmatch_lines(["*test_one has hung*"])


def test_after_a_case_that_fails_at_once_the_others_run(run):
    done = run(HANGS.format(hangs="", one="assert False"), patience=60.0)

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
