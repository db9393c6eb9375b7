# SPDX-License-Identifier: BSD-3-Clause
"""The processes of a measurement end with it, however it ends."""

import multiprocessing
import os
import signal
import subprocess
import sys

import psutil
import pytest

from hive_lab.bench.workers import workers

ENDLESS = """
import signal, sys
from hive_lab.bench.workers import workers

def stay(_):
    print("at work", flush=True)
    signal.pause()

signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))
with workers() as pool:
    list(pool.map(stay, range(20)))
"""


def test_they_do_the_work():
    others = set(multiprocessing.active_children())  # of other tests
    with workers() as pool:
        assert list(pool.map(abs, (-1, -2))) == [1, 2]
    assert set(multiprocessing.active_children()) <= others


@pytest.mark.parametrize("method", ["fork", "forkserver"])
def test_a_worker_ends_with_a_signal_that_its_parent_handles(method):
    with workers(method) as pool:
        handlers = pool.submit(signal.getsignal, signal.SIGTERM).result()

    assert handlers == signal.SIG_DFL


@pytest.mark.parametrize(("ends", "code"), [(signal.SIGTERM, 7), (signal.SIGINT, -signal.SIGINT)])
def test_a_measurement_that_is_ended_leaves_no_process(ends, code):
    program = psutil.Popen([sys.executable, "-c", ENDLESS], stdout=subprocess.PIPE)
    program.stdout.readline()
    own = program.children()
    os.kill(program.pid, ends)
    _, alive = psutil.wait_procs([program, *own], timeout=60)
    for each in alive:
        each.kill()
    program.stdout.close()

    assert own
    assert not alive
    assert program.returncode == code
