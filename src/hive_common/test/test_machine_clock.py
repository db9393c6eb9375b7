# SPDX-License-Identifier: BSD-3-Clause
"""The clock of leases and elections."""

import time

from hive_common.machine_clock import machine_time


def test_the_time_that_a_machine_sleeps_passes(monkeypatch):
    slept = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: 100.0)
    monkeypatch.setattr(
        time, "clock_gettime", lambda clock: 100.0 + slept * (clock == time.CLOCK_BOOTTIME)
    )
    before = machine_time()

    slept = 12.0

    assert machine_time() - before == 12.0
