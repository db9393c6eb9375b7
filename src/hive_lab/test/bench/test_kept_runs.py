# SPDX-License-Identifier: BSD-3-Clause
"""Results of long measurements are kept, and nothing is measured twice."""

import multiprocessing
import signal

import pytest

from hive_common.errors import FileError
from hive_lab.bench.kept_runs import KeptRuns


def double(number):
    """Stand for a run."""
    return {"double": 2 * number}


def fail(_number):
    """Stand for a run that nobody should do again."""
    raise AssertionError


def test_results_come_in_order_and_are_not_measured_twice(tmp_path):
    file = tmp_path / "runs"
    first = KeptRuns(file).all_of({f"run {n}": (double, (n,)) for n in (3, 1)})
    again = KeptRuns(file).all_of(
        {"run 1": (fail, (1,)), "run 2": (double, (2,)), "run 3": (fail, (3,))}
    )

    assert first == [{"double": 6}, {"double": 2}]
    assert again == [{"double": 2}, {"double": 4}, {"double": 6}]


def test_a_line_that_was_cut_off_is_measured_again(tmp_path):
    file = tmp_path / "runs"
    KeptRuns(file).all_of({"run 1": (double, (1,))})
    with file.open("a") as end:
        end.write('{"run": "run 2", "resu')
    jobs = {"run 1": (fail, (1,)), "run 2": (double, (2,))}

    assert KeptRuns(file).all_of(jobs) == [{"double": 2}, {"double": 4}]
    assert KeptRuns(file).all_of(dict.fromkeys(jobs, (fail, (0,)))) == [
        {"double": 2},
        {"double": 4},
    ]


def test_a_run_that_fails_ends_the_measurement_at_once():
    jobs = {"run 1": (fail, (1,)), "run 2": (signal.pause, ())}
    others = set(multiprocessing.active_children())  # of other tests

    with pytest.raises(AssertionError):
        KeptRuns(None).all_of(jobs)

    assert set(multiprocessing.active_children()) <= others


def test_another_file_is_refused_with_its_line(tmp_path):
    file = tmp_path / "notes"
    file.write_text("buy milk\n")

    with pytest.raises(FileError, match=r"notes:1: 'buy milk'; allowed: runs that --resume"):
        KeptRuns(file)
    assert file.read_text() == "buy milk\n"
