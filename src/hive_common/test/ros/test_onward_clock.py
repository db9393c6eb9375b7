# SPDX-License-Identifier: BSD-3-Clause
from hive_common.ros.onward_clock import OnwardClock, SetBack


class SetClock:
    """A clock that shows what it is set to [s]."""

    time = 1100.0

    def read(self):
        return self.time


def test_it_advances_with_the_other_clock():
    other = SetClock()
    clock = OnwardClock(other.read)
    other.time += 2.5

    assert clock.now() == 1102.5


def test_it_goes_on_when_the_other_clock_is_reset():
    other = SetClock()
    clock = OnwardClock(other.read)
    other.time = 500.0
    at_reset = clock.now()
    other.time += 2.5

    assert at_reset == 1100.0
    assert clock.now() == 1102.5


def test_it_counts_each_reset_once():
    other = SetClock()
    clock = OnwardClock(other.read)
    for other.time in (500.0, 500.0, 3.0, 4.0):
        clock.now()

    assert clock.now() == 1101.0


def test_a_clock_that_was_set_back_is_noticed_once():
    other = SetClock()
    was_set_back = SetBack(other.read)
    said = []
    for other.time in (1101.0, 1100.5, 500.0, 501.0, 3.0):
        said.append(was_set_back())

    assert said == [False, False, True, False, True]
