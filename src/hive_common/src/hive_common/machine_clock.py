# SPDX-License-Identifier: BSD-3-Clause
"""The clock by which members and robots count leases, elections and silence."""

from __future__ import annotations

import time


def machine_time() -> float:
    """Return the time since this machine started [s], the time it slept included.

    `time.monotonic` stands still while a machine sleeps, on Linux. A member that wakes would
    believe a lease that has ended for all others. See CLOCK_BOOTTIME in clock_gettime(2).
    """
    return time.clock_gettime(time.CLOCK_BOOTTIME)
