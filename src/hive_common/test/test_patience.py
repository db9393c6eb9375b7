# SPDX-License-Identifier: BSD-3-Clause
"""A wait is as long as it says, and longer on a machine that does not keep up."""

import pytest

from hive_common.patience import MOST_OF_A_LOOK, listen_until


class Machine:
    """A wall clock that goes on while somebody listens, and what comes meanwhile.

    Attributes:
        now: [s]
        stalls: How much longer than asked for each look takes [s].
        looks: How many there were.
    """

    def __init__(self, comes_at=float("inf"), stalls=0.0):
        self.now, self.stalls, self.looks = 0.0, stalls, 0
        self._comes_at = comes_at

    def waits(self, seconds, look=MOST_OF_A_LOOK):
        return listen_until(self._has_come, seconds, self._listen, lambda: self.now, look)

    def _has_come(self):
        return self.now >= self._comes_at

    def _listen(self, most):
        self.looks += 1
        self.now = min(self.now + most, max(self._comes_at, self.now)) + self.stalls


def test_a_wait_ends_with_what_it_waits_for():
    machine = Machine(comes_at=0.25)

    assert machine.waits(1.0)
    assert machine.now == pytest.approx(0.25)


def test_a_wait_for_what_never_comes_takes_its_time():
    machine = Machine()

    assert not machine.waits(1.0)
    assert machine.now == pytest.approx(1.0)


def test_a_look_is_never_longer_than_it_may_be():
    machine = Machine()
    machine.waits(1.0, look=0.002)

    assert machine.looks == pytest.approx(500, abs=1)
    assert machine.now == pytest.approx(1.0)


def test_what_came_while_the_process_had_no_processor_is_taken_in():
    machine = Machine(comes_at=2.0, stalls=0.5)

    assert machine.waits(1.0)


def test_a_wait_takes_longer_on_a_machine_that_does_not_keep_up():
    machine = Machine(stalls=0.18)

    assert not machine.waits(1.0)
    assert machine.now == pytest.approx(10.0)


def test_what_is_done_is_not_waited_for():
    machine = Machine(comes_at=0.0)

    assert machine.waits(0.0)
    assert machine.looks == 0


def test_without_patience_there_is_no_look():
    machine = Machine()

    assert not machine.waits(0.0)
    assert machine.looks == 0
