# SPDX-License-Identifier: BSD-3-Clause
"""What fails on real ROS or in a window runs once more, and nothing else does."""

import pytest

from hive_lab.runner.second_look import MOST

pytest_plugins = ["pytester"]

FAILS_ONCE = """
from pathlib import Path

def test_it():
    tried = Path(__file__).with_suffix(".tried")
    has_run = tried.exists()
    tried.touch()
    assert has_run, "the machine was busy"
"""
FAILS = "def test_it():\n    assert 'left' == 'right'\n"
PASSES = "def test_it():\n    pass\n"


@pytest.fixture
def run(pytester):
    """Return a function that runs tests, given by their files, and returns the result.

    Its outcomes are those of pytest's closing line.
    """

    def run_files(files, *options):
        pytester.makefile(".toml", pyproject="[tool.pytest.ini_options]\n")
        for name, text in files.items():
            file = pytester.path / name
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        return pytester.runpytest_subprocess(
            *("-c", "pyproject.toml", "-p", "hive_lab.runner.plugin", "-p", "no:cacheprovider"),
            *("--import-mode=importlib", "--second-look", *options),
            *files,
        )

    return run_files


def test_a_test_on_ros_that_passes_alone_counts_as_passed_and_is_named(run, pytester):
    done = run({"test/rostest/test_a.py": FAILS_ONCE, "test/rostest/test_b.py": PASSES})

    assert done.ret == 0
    assert done.parseoutcomes() == {"passed": 2, "flaky": 1}
    done.stdout.fnmatch_lines(["test/rostest/test_a.py::test_it: line 8: AssertionError: the*"])
    (line,) = (pytester.path / "results/flaky.txt").read_text().splitlines()
    what = "test/rostest/test_a.py::test_it: line 8: AssertionError: the machine was busy"
    assert line.endswith(what)


def test_of_a_failure_in_a_helper_the_line_of_the_test_is_named(run):
    helper = FAILS_ONCE.replace("def test_it():", "def wait():")
    done = run({"test/gui/test_a.py": "from helper import wait\n\ndef test_it():\n    wait()\n",
                "test/gui/conftest.py": "import sys\nsys.path.insert(0, 'test/gui')\n",
                "test/gui/helper.py": helper})  # fmt: skip

    done.stdout.fnmatch_lines(["test/gui/test_a.py::test_it: line 4: AssertionError: the*"])


def test_it_runs_after_all_others(run):
    last = "from pathlib import Path\ndef test_it():\n    assert Path('others_ran').exists()\n"
    other = "from pathlib import Path\ndef test_it():\n    Path('others_ran').touch()\n"
    done = run({"test/gui/test_a.py": last, "test/hive/test_b.py": other})

    assert done.parseoutcomes() == {"passed": 2, "flaky": 1}


def test_a_test_that_fails_again_is_a_failure_with_both_reasons(run):
    done = run({"test/gui/test_a.py": FAILS})

    assert done.ret == 1
    assert done.parseoutcomes() == {"failed": 1}
    done.stdout.fnmatch_lines(["E*'left' == 'right'*", "*first failure*", "E*'left' == 'right'*"])


@pytest.mark.parametrize("folder", ["test/hive", "test/unit", "src/blackboard/test"])
def test_no_other_level_is_repeated(run, folder):
    done = run({f"{folder}/test_a.py": FAILS_ONCE})

    assert done.parseoutcomes() == {"failed": 1}


def test_many_failures_count_at_once(run):
    done = run({f"test/rostest/test_{number}.py": FAILS_ONCE for number in range(MOST + 1)})

    assert done.ret == 1
    assert done.parseoutcomes() == {"failed": MOST + 1}


def test_several_failures_of_one_file_are_one_file(run):
    cases = "import pytest\n" + FAILS_ONCE.replace(
        "def test_it():", "@pytest.mark.parametrize('n', range(6))\ndef test_it(n):"
    ).replace('".tried"', 'f".{n}"')
    done = run({"test/rostest/test_a.py": cases})

    assert done.ret == 0
    assert done.parseoutcomes() == {"passed": 6, "flaky": 6}


def test_who_stops_at_the_first_failure_sees_it_at_once(run):
    done = run({"test/rostest/test_a.py": FAILS_ONCE, "test/rostest/test_b.py": PASSES}, "-x")

    assert done.parseoutcomes() == {"failed": 1}


def test_a_failure_counts_when_the_run_is_interrupted(run):
    stops = "def test_it():\n    raise KeyboardInterrupt\n"
    done = run({"test/rostest/test_c.py": FAILS_ONCE, "test/unit/test_d.py": stops})

    assert done.ret == 2
    assert done.parseoutcomes()["failed"] == 1


def test_failures_in_workers_get_a_second_look_too(run):
    grouped = "import pytest\npytestmark = pytest.mark.xdist_group('screen')\n" + FAILS_ONCE
    done = run({"test/gui/test_a.py": grouped, "test/rostest/test_b.py": FAILS_ONCE}, "-n", "2",
               "--dist", "loadgroup")  # fmt: skip

    assert done.ret == 0
    assert done.parseoutcomes() == {"passed": 2, "flaky": 2}


def test_the_last_lines_tell_minutes_per_level_and_the_slowest_tests(run):
    done = run({"test/rostest/test_a.py": PASSES, "src/blackboard/test/test_b.py": PASSES})

    assert done.ret == 0
    done.stdout.fnmatch_lines(
        [
            "minutes per level, summed over the workers: * 0.0, * 0.0",
            "slowest tests:",
            "* s  *test_it",
            "* s  *test_it",
        ]
    )
