# SPDX-License-Identifier: BSD-3-Clause
"""Turns of tests, here of threads: the kernel's locks belong to who has opened the file."""

import fcntl
import queue
import threading

import pytest

from hive_lab.runner.turns import turn

WITHIN = 20.0  # a busy machine needs no longer [s]


class Taker:
    """Takes a turn in a thread of its own, and gives it back when it is told to."""

    def __init__(self, folder, events, name, *, alone=False):
        self._ends = threading.Event()
        self._thread = threading.Thread(
            target=self._take, args=(folder, events, name, alone), daemon=True
        )
        self._thread.start()

    def _take(self, folder, events, name, alone):
        with turn(folder, alone=alone):
            events.put(name)
            self._ends.wait(WITHIN)

    def end(self):
        self._ends.set()
        self._thread.join(WITHIN)


@pytest.fixture
def events():
    """Who has got a turn, in that order."""
    return queue.Queue()


def test_those_who_need_not_be_alone_have_turns_at_the_same_time(tmp_path, events):
    takers = [Taker(tmp_path, events, name) for name in ("a", "b")]

    assert {events.get(timeout=WITHIN) for _ in takers} == {"a", "b"}
    for each in takers:
        each.end()


def test_nobody_else_has_a_turn_while_one_is_alone(tmp_path, events):
    alone = Taker(tmp_path, events, "alone", alone=True)
    assert events.get(timeout=WITHIN) == "alone"
    other = Taker(tmp_path, events, "other")

    with pytest.raises(queue.Empty):
        events.get(timeout=0.2)
    alone.end()
    assert events.get(timeout=WITHIN) == "other"
    other.end()


def test_who_wants_to_be_alone_goes_before_those_who_come_later(tmp_path, events):
    first = Taker(tmp_path, events, "first")
    assert events.get(timeout=WITHIN) == "first"
    alone = Taker(tmp_path, events, "alone", alone=True)
    while not is_held(tmp_path / "robo-hive-next"):
        pass
    later = Taker(tmp_path, events, "later")
    first.end()

    assert events.get(timeout=WITHIN) == "alone"
    alone.end()
    assert events.get(timeout=WITHIN) == "later"
    later.end()


def is_held(path):
    """Return whether somebody holds the lock of a file."""
    with path.open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
