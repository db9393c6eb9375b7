# SPDX-License-Identifier: BSD-3-Clause
"""Gives every process that is started with this folder on PYTHONPATH a clock that a test holds.

Python imports a module of this name by itself, before any other takes a clock from `time`.
The file in HIVE_CLOCK has the time, which goes on while a machine sleeps; that in HIVE_SLEPT says
for how long this process's machine has slept. `cases/faults/held_clock.py` writes both [s].
"""

import mmap
import os
import struct
import time
from pathlib import Path


def value_of(file):
    """Return a function that returns the number in a file."""
    with Path(file).open("rb") as opened:
        shared = mmap.mmap(opened.fileno(), 8, access=mmap.ACCESS_READ)
    return lambda: struct.unpack("=d", shared[:8])[0]


time_passed, slept = value_of(os.environ["HIVE_CLOCK"]), value_of(os.environ["HIVE_SLEPT"])
other_clocks = time.clock_gettime


def awake():
    """Return the time without that which the machine has slept [s]."""
    return time_passed() - slept()


def read_clock(clock):
    """Do what `time.clock_gettime` does."""
    if clock == time.CLOCK_BOOTTIME:
        return time_passed()
    return awake() if clock == time.CLOCK_MONOTONIC else other_clocks(clock)


time.clock_gettime, time.monotonic = read_clock, awake
