# SPDX-License-Identifier: BSD-3-Clause
"""The process that ends drives: what it is told, and what it makes of that."""

import math
import os
import subprocess
from types import SimpleNamespace

import pytest

from blackboard.robot.drive_guard import Drive
from blackboard.ros import guard_process
from blackboard.ros.guard_process import GuardProcess, wait_for

ONE, TWO = Drive("/robot1/move_base", "a"), Drive("/robot2/move_base", "b")


class Children:
    """The processes that were started; the test reads what they are told."""

    def __init__(self, monkeypatch):
        self.ends = []
        self.codes = []
        self.pipes = []
        monkeypatch.setattr(subprocess, "Popen", self._start)

    def _start(self, *_words, **_options):
        reads, writes = os.pipe()
        self.ends.append(reads)
        self.codes.append(None)
        self.pipes.append(os.fdopen(writes, "wb", 0))
        number = len(self.codes) - 1
        return SimpleNamespace(stdin=self.pipes[number], poll=lambda: self.codes[number])

    def told(self, number):
        return os.read(self.ends[number], 65536).decode().splitlines()


@pytest.fixture
def children(monkeypatch):
    found = Children(monkeypatch)
    yield found
    for pipe in found.pipes:
        pipe.close()


def test_it_is_started_before_the_first_drive_and_told_of_each_change(children):
    guard = GuardProcess()
    assert len(children.ends) == 1

    guard.hold(ONE, 10.5)
    guard.hold(ONE, 11.5)
    guard.drop(ONE)
    guard.drop(ONE)

    assert children.told(0) == [
        '["/robot1/move_base", "a", 10.5]',
        '["/robot1/move_base", "a", 11.5]',
        '["/robot1/move_base", "a", null]',
    ]


def test_one_that_has_ended_is_started_again_and_told_all_drives(children):
    guard = GuardProcess()
    guard.hold(ONE, 10.0)
    guard.hold(TWO, 11.0)
    children.codes[0] = -9

    guard.hold(TWO, 12.0)

    assert children.told(1) == [
        '["/robot1/move_base", "a", 10.0]',
        '["/robot2/move_base", "b", 12.0]',
    ]


def test_one_that_reads_nothing_holds_nobody_up(children):
    guard = GuardProcess()

    for number in range(5000):
        guard.hold(ONE, float(number))

    assert children.told(0)[0] == '["/robot1/move_base", "a", 0.0]'


class Guarding:
    """The process itself, which the test tells of drives; its time is the test's."""

    def __init__(self, monkeypatch):
        self.now = 0.0
        self.cancelled = []
        self.readied = []
        self.loaded = []
        self.steps = []
        reads, self._writes = os.pipe()
        self.stdin = os.fdopen(reads, "rb", 0)
        monkeypatch.setattr(guard_process, "machine_time", lambda: self.now)
        monkeypatch.setattr(guard_process.select, "select", self._wait)
        monkeypatch.setattr(guard_process.sys, "stdin", self.stdin)
        monkeypatch.setattr(guard_process.signal, "alarm", lambda _: None)
        monkeypatch.setattr(guard_process, "_cancel", self._cancel)
        monkeypatch.setattr(guard_process, "_become_node", lambda: self.readied.append(self.now))
        monkeypatch.setattr(guard_process, "_rospy", lambda: self.loaded.append(self.now))

    def _wait(self, *_files_and_time):
        """Take the next step of the test: a time that passes, or what comes in."""
        step = self.steps.pop(0) if self.steps else b""
        if isinstance(step, float):
            self.now = step
            return [], [], []
        if step:
            os.write(self._writes, step)
        else:
            os.close(self._writes)
        return [self.stdin], [], []

    def _cancel(self, drives, why):
        self.cancelled += [(drive, self.now, why.split()[-1]) for drive in drives]

    def run(self, *steps):
        self.steps += steps
        guard_process.main()
        return self.cancelled


@pytest.fixture
def guarding(monkeypatch):
    found = Guarding(monkeypatch)
    yield found
    found.stdin.close()


HELD = b'["/robot1/move_base", "a", 10.0]\n'


def test_a_drive_whose_lease_was_not_renewed_is_cancelled(guarding):
    assert guarding.run(HELD, 10.1, 10.3) == [(ONE, 10.3, "renewed")]


def test_a_drive_is_cancelled_when_the_process_of_its_robot_ends(guarding):
    assert guarding.run(HELD, 5.0) == [(ONE, 5.0, "ended")]


def test_it_gets_ready_before_it_has_to_cancel_a_drive(guarding):
    guarding.run(HELD, 8.5, 9.0, 11.0)

    assert guarding.readied == [9.0]


def test_it_loads_rospy_once_in_the_first_minute_while_it_guards_no_drive(guarding):
    guarding.run(5.0, 50.0, 60.0)
    assert guarding.loaded == [50.0]


def test_it_loads_rospy_only_after_the_drive_that_it_guards(guarding):
    drive, ended = HELD.replace(b"10.0", b"90.0"), HELD.replace(b"10.0", b"null")
    guarding.run(drive, 50.0, 55.0, ended)

    assert guarding.loaded == [55.0]


def test_a_line_may_come_in_pieces(guarding):
    assert guarding.run(HELD[:9], HELD[9:], 5.0) == [(ONE, 5.0, "ended")]


def test_a_drive_that_has_ended_is_not_cancelled(guarding):
    ended = b'["/robot1/move_base", "a", null]\n'

    assert guarding.run(HELD + ended, 11.0) == []


def test_while_it_guards_a_drive_it_looks_at_its_clock_every_second_as_its_machine_may_sleep():
    assert [wait_for(left) for left in (-0.5, 0.2, 3.0)] == [0.0, 0.2, 1.0]
    assert wait_for(math.inf) is None


def test_it_wakes_to_load_rospy(guarding):
    guarding.now = 3.0

    assert wait_for(math.inf, 14.5) == 11.5
    assert wait_for(math.inf, 2.5) == 0.0
    assert wait_for(2.0, 14.5) == 1.0
