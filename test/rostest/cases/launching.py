# SPDX-License-Identifier: BSD-3-Clause
"""Starts launch files as an operator does, and kills nodes as nobody should."""

import contextlib
import os
import signal
import subprocess
import time
import xmlrpc.client

import psutil
import rosgraph

from hive_lab.runner.limits import PATIENCE

TIME_TO_STOP = 180.0
"""Limit for what hangs [s]. roslaunch gives each node 15 s after SIGINT and 2 s after SIGTERM, and
ends some of them one after the other."""
POLL = 0.2


class Launches:
    """The launched processes that have to end."""

    def __init__(self):
        self._running = []

    def start(self, package, file, **arguments):
        """Launch a file with arguments; return the process."""
        words = [f"{name}:={value}" for name, value in arguments.items()]
        return self.run("roslaunch", package, file, *words)

    def run(self, *words):
        """Start a command, without waiting for it; return the process."""
        process = subprocess.Popen(words, stdin=subprocess.DEVNULL, start_new_session=True)
        self._running.append(process)
        return process

    def stop(self, *processes):
        """Interrupt processes, by default all, and wait until they end."""
        chosen = processes or tuple(self._running)
        for process in chosen:
            self._running.remove(process)
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in chosen:
            try:
                process.wait(TIME_TO_STOP)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


HIVE = ("rosrun", "fleet_manager", "hive")
"""The command line."""


def run_hive(*words, **environment):
    """Run `hive` with words; return the finished process. Nobody is there to answer a question.

    Further arguments are added to its environment.
    """
    return subprocess.run(
        [*HIVE, *words],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE,
        stdin=subprocess.DEVNULL,
    )


@contextlib.contextmanager
def hive_started(*words, **environment):
    """Start `hive` as `run_hive` does, without waiting for it; kill it at the end."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*HIVE, *words],
        env=os.environ | environment,
        stdin=subprocess.DEVNULL,
        stdout=pipe,
        stderr=pipe,
        text=True,
    ) as started:
        try:
            yield started
        finally:
            started.kill()


def pid_of(node):
    """Return the process id of a node."""
    uri = rosgraph.Master("/operator").lookupNode(node)
    with xmlrpc.client.ServerProxy(uri) as slave:
        return slave.getPid("/operator")[2]


def kill(*nodes):
    """Kill nodes (SIGKILL)."""
    for pid in [pid_of(node) for node in nodes]:
        os.kill(pid, signal.SIGKILL)


def sockets_of(started):
    """Return name and address for each TCP and UDP port of a process and those below it."""
    root, found = psutil.Process(started.pid), set()
    for process in (root, *root.children(recursive=True)):
        with contextlib.suppress(psutil.NoSuchProcess):
            # Debian 12's psutil has no `net_connections`, and later ones warn of the other name.
            connections = getattr(process, "net_connections", None) or process.connections
            found |= {
                (process.name(), each.laddr.ip)
                for each in connections("inet")
                if each.status in {psutil.CONN_LISTEN, psutil.CONN_NONE}  # the second: UDP
            }
    return found


def publishers_of(topic):
    """Return how many publishers of a topic the master knows."""
    return len(dict(rosgraph.Master("/operator").getSystemState()[0]).get(topic, ()))


def wait_until_empty(look, since=None):
    """Wait until a look finds nothing missing; return how long that took since a time [s].

    Args:
        look: Returns what is missing.
        since: A time on the monotonic clock [s]; None: now.
    """
    since = time.monotonic() if since is None else since
    while left := look():
        passed = time.monotonic() - since
        assert passed < PATIENCE, f"still missing after {passed:.0f} s: {left}"
        time.sleep(POLL)  # the master tells nobody what is new
    return time.monotonic() - since
