# SPDX-License-Identifier: BSD-3-Clause
"""The plugin that runs `.test` files notices what rostest itself lets pass."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
FILE = """<launch>
  <test test-name="case" pkg="hive_tests" type="pytest_node" args="{case}" time-limit="{limit}"/>
</launch>
"""
BACKGROUND = """
import subprocess
def test_leaves_a_process():
    subprocess.Popen(["tail", "-f", "/dev/null"], start_new_session=True)
"""


@pytest.fixture
def run(tmp_path):
    """Return a function that runs pytest on a `.test` file with the given case, and its output."""

    def run_case(text, limit=400):
        case = tmp_path / "case.py"
        case.write_text(text)
        (tmp_path / "file.test").write_text(FILE.format(case=case, limit=limit))
        (tmp_path / "conftest.py").symlink_to(HERE / "conftest.py")
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", tmp_path / "file.test"],
            env=os.environ | {"TMPDIR": str(tmp_path)},
            capture_output=True,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout

    return run_case


def test_a_file_whose_cases_pass_is_a_passed_test(run):
    code, output = run("def test_one(): assert True")

    assert code == 0
    assert "1 passed" in output


def test_a_failed_case_is_shown_with_its_name_and_its_text(run):
    code, output = run("def test_one(): assert 'left' == 'right'")

    assert code == 1
    assert "test_one" in output
    assert "assert 'left' == 'right'" in output


def test_a_test_node_without_a_case_is_a_failure(run):
    code, output = run("")

    assert code == 1
    assert "case: ran no case" in output


def test_a_test_node_that_does_not_end_is_a_failure(run):
    code, output = run("import threading\ndef test_one(): threading.Event().wait()", limit=2)

    assert code == 1
    assert "max time [2.0s] allotted" in output


def test_a_process_that_is_left_running_is_ended_and_is_a_failure(run):
    code, output = run(BACKGROUND)

    assert code == 1
    assert "left running: tail -f /dev/null" in output
