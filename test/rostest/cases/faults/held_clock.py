# SPDX-License-Identifier: BSD-3-Clause
"""Hives whose elections and leases do not depend on the machine: the test has their clock.

The clock never passes faster than that of the machine, and never goes on while somebody is behind
who has to keep up. So whoever is slow is waited for, and who is silent by this clock is silent
however long the machine would have needed to run it.

A test can also put the machine of a node to sleep: `HeldHive.sleep`.
"""

import contextlib
import mmap
import os
import struct
import threading
import time
from pathlib import Path

import psutil

from blackboard.errors import LiveHiveError
from hive_common.machine_clock import machine_time
from hive_lab.live.live_hive import LiveHive
from hive_lab.runner.limits import PATIENCE

HELD_CLOCK = Path(__file__).resolve().parents[2] / "held_clock"
"""Has the module that gives a process this clock."""
LOOK_EVERY = 0.01
MOST_AT_ONCE = 0.05
"""Most time that passes between two looks [s]: a machine that stood still has lost no time."""
PATIENT = {"server_timeout": 60.0}
"""Parameters of robots that take no base for frozen because the machine is slow."""
STEADY = {"min_election": 2.2}
"""Parameters of a blackboard node: a machine that stands still for a second is no reason for a
takeover in a hive whose clock nobody holds."""
BEHIND = 0.6
"""Whoever has answered nothing that is younger is behind [s]: three heartbeats, and far less than
an election or a lease lasts."""


class SharedNumber:
    """A number in a file, which other processes read.

    Args:
        file: A new one.
        number: What it holds first.
    """

    def __init__(self, file, number):
        self.file, self.number = file, number
        file.write_bytes(struct.pack("=d", number))
        with file.open("r+b") as opened:
            self._memory = mmap.mmap(opened.fileno(), 8)

    def set(self, number):
        """Change it."""
        self.number = number
        self._memory[:8] = struct.pack("=d", number)


class HeldClock:
    """The clock of a hive's nodes.

    Args:
        folder: Where its file is.
    """

    def __init__(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        self._time = machine_time()
        self.shared = SharedNumber(folder / "clock", self._time)
        self._stands, self._until = False, 0.0
        self._changed = threading.Condition()
        self._operator, self._watched = None, frozenset()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def end(self):
        """Stop it for good."""
        self._ended.set()
        self._thread.join()

    def now(self):
        """Return its time [s]."""
        with self._changed:
            return self._time

    def pass_time(self, seconds):
        """Wait until so much time has passed by this clock [s]."""
        with self._changed:
            self._until = end = self._time + seconds
            if not self._changed.wait_for(lambda: self._time >= end, PATIENCE):
                raise LiveHiveError(f"for {PATIENCE:.0f} s {self._behind()} did not keep up")

    @contextlib.contextmanager
    def standing(self):
        """Let no time pass meanwhile but what `pass_time` lets pass."""
        with self._changed:
            self._stands, self._until = True, self._time
        try:
            yield
        finally:
            with self._changed:
                self._stands = False

    @contextlib.contextmanager
    def held_for(self, operator, members):
        """Let time pass meanwhile only if these members keep up.

        The leader has spoken lately, and the others have answered it. Nobody has to answer a
        leader that is not among them.
        """
        with self._changed:
            self._operator, self._watched = operator, frozenset(members)
        try:
            yield
        finally:
            with self._changed:
                self._watched = frozenset()

    def _behind(self):
        """Return who is behind."""
        operator, last = self._operator, self._operator and self._operator.last
        if last is None or last.active not in self._watched:
            return ()
        latest = {name: operator.echoed.get(name, 0.0) for name in self._watched}
        latest[last.active] = last.sent
        return tuple(name for name, at in sorted(latest.items()) if self._time - at > BEHIND)

    def _run(self):
        before = time.monotonic()
        while not self._ended.wait(LOOK_EVERY):
            now = time.monotonic()
            with self._changed:
                if not self._behind():
                    passed = min(now - before, MOST_AT_ONCE)
                    if self._stands:
                        passed = min(passed, self._until - self._time)
                    self._time += passed
                    self.shared.set(self._time)
                    self._changed.notify_all()
            before = now


class HeldHive(LiveHive):
    """A hive whose nodes have a clock that the test holds: `clock`.

    Args:
        folder: See `LiveHive`, also for all other arguments.
    """

    def __init__(self, folder, *arguments, **options):
        super().__init__(folder, *arguments, robot=PATIENT, **options)
        self.clock = HeldClock(folder)
        self._slept, self._asleep = {}, {}

    def start(self, node, *arguments, environment=None, **options):
        """Start a node with the clock of this hive."""
        if node not in self._slept:
            file = self._folder / f"slept{node.replace('/', '-')}"
            self._slept[node] = SharedNumber(file, 0.0)
        clock = {
            "HIVE_CLOCK": str(self.clock.shared.file),
            "HIVE_SLEPT": str(self._slept[node].file),
            "PYTHONPATH": f"{HELD_CLOCK}:{os.environ.get('PYTHONPATH', '')}",
        }
        super().start(node, *arguments, environment={**clock, **(environment or {})}, **options)

    def sleep(self, node):
        """Put the machine of a node to sleep: its processes stop, and its monotonic clock stands.

        What reaches it meanwhile waits; a test that wants it lost cuts the network.
        """
        own = psutil.Process(self.pid_of(node))
        processes = [own, *own.children(recursive=True)]  # a robot's guard among them
        for process in processes:
            process.suspend()
        self._asleep[node] = (processes, self.clock.now())

    def wake(self, node):
        """Wake the machine of a node."""
        processes, since = self._asleep.pop(node)
        slept = self._slept[node]
        slept.set(slept.number + self.clock.now() - since)
        for process in processes:
            process.resume()

    def held(self, *without):
        """Return a context in which time passes only if all members keep up, but those named."""
        return self.clock.held_for(self.operator, set(self.members) - set(without))

    def end(self):
        """Kill every node."""
        super().end()
        self.clock.end()
