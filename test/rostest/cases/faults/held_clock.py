# SPDX-License-Identifier: BSD-3-Clause
"""Hives whose elections and leases do not depend on the machine: the test has their clock.

The clock never passes faster than that of the machine, and never goes on while somebody is behind
who has to keep up. So whoever is slow is waited for, and who is silent by this clock is silent
however long the machine would have needed to run it.
"""

import contextlib
import mmap
import struct
import sys
import threading
import time
from pathlib import Path

from blackboard.errors import LiveHiveError
from hive_common.machine_clock import machine_time
from hive_lab.live.live_hive import LiveHive
from hive_lab.runner.limits import PATIENCE

HELD_CLOCK = Path(__file__).resolve().parents[2] / "nodes" / "held_clock"
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


class HeldClock:
    """The clock of a hive's nodes.

    Args:
        folder: Where its file is.
    """

    def __init__(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        self.file = folder / "clock"
        self._time = machine_time()
        self.file.write_bytes(struct.pack("=d", self._time))
        with self.file.open("r+b") as opened:
            self._shared = mmap.mmap(opened.fileno(), 8)
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
            end = self._time + seconds
            if not self._changed.wait_for(lambda: self._time >= end, PATIENCE):
                raise LiveHiveError(f"for {PATIENCE:.0f} s {self._behind()} did not keep up")

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
                    self._time += min(now - before, MOST_AT_ONCE)
                    self._shared[:8] = struct.pack("=d", self._time)
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

    def start(self, node, *arguments, program=(), **options):
        """Start a node; `program` is a module, or a program of the folder nodes with arguments."""
        module = "robot_node" if self.robot_of(node) else "blackboard_node"
        words = program or (f"blackboard.ros.{module}",)
        held = (sys.executable, str(HELD_CLOCK), str(self.clock.file), *words)
        super().start(node, *arguments, program=held, **options)

    def held(self, *without):
        """Return a context in which time passes only if all members keep up, but those named."""
        return self.clock.held_for(self.operator, set(self.members) - set(without))

    def end(self):
        """Kill every node."""
        super().end()
        self.clock.end()
