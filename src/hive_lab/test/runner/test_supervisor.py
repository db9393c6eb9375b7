# SPDX-License-Identifier: BSD-3-Clause
"""Whatever a command starts ends with it."""

import os
import signal
import subprocess
import sys

import psutil
import pytest

from hive_lab.runner.supervisor import TIME_TO_REPORT

LEAVES = """
import subprocess, sys
left = subprocess.Popen(["tail", "-f", "/dev/null"], start_new_session=True)
sys.stdout.write(f"{left.pid}\\n")
sys.stdout.flush()
"""
WAITS = f"""
import signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
{LEAVES}
signal.sigwait([signal.SIGINT])
sys.exit(2)
"""
IGNORES = f"""
import signal
signal.signal(signal.SIGINT, signal.SIG_IGN)
{LEAVES}
while True:
    signal.pause()
"""
SUPERVISOR = """
import sys
from hive_lab.runner.supervisor import main
sys.exit(main(sys.argv[1:], patience=0.2))
"""


@pytest.fixture
def start():
    """Return a function that starts a program under the supervisor."""
    started = []

    def start_program(code):
        process = subprocess.Popen(
            [sys.executable, "-c", SUPERVISOR, sys.executable, "-c", code],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        return process

    yield start_program
    for process in started:
        process.kill()
        process.communicate()


def test_the_exit_code_is_the_commands(start):
    assert start("raise SystemExit(7)").wait() == 7


def test_a_command_that_a_signal_ended_has_the_code_of_a_shell(start):
    assert start("import os\nos.kill(os.getpid(), 9)").wait() == 137


def test_what_a_command_leaves_running_is_ended_and_named(start):
    run = start(LEAVES)
    left, said = run.communicate()

    assert not psutil.pid_exists(int(left))
    assert said == "left running, and ended now: tail -f /dev/null\n"
    assert run.returncode == 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_run_that_is_terminated_ends_everything(start, number):
    run = start(WAITS)
    left = int(run.stdout.readline())
    run.send_signal(number)
    run.communicate()

    assert run.returncode == 2
    assert not psutil.pid_exists(left)


def test_ctrl_c_ends_everything(start):
    run = start(WAITS)
    left = int(run.stdout.readline())
    # As a terminal does: to the whole process group, of which the test's process is a part.
    for process in [run.pid, *(each.pid for each in psutil.Process(run.pid).children())]:
        os.kill(process, signal.SIGINT)
    run.communicate()

    assert run.returncode == 2
    assert not psutil.pid_exists(left)


def test_a_command_that_does_not_end_in_time_is_killed(start):
    run = start(IGNORES)
    left = int(run.stdout.readline())
    run.send_signal(signal.SIGTERM)
    # The alarm that the supervisor has set, without waiting for it.
    os.kill(run.pid, signal.SIGALRM)
    run.communicate(timeout=TIME_TO_REPORT)

    assert run.returncode == 137
    assert not psutil.pid_exists(left)
