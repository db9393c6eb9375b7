# SPDX-License-Identifier: BSD-3-Clause
"""Lets a test that measures have the machine to itself, while others run side by side."""

import fcntl
import os
import tempfile
from pathlib import Path

import pytest


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item):
    """Share the machine with the other processes of this run, or wait until it is free."""
    run = os.environ.get("PYTEST_XDIST_TESTRUNUID")
    if run is None:
        yield
        return
    alone = item.get_closest_marker("alone") is not None
    with (Path(tempfile.gettempdir()) / f"robo-hive-test-{run}").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield
