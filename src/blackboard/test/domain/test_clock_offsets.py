# SPDX-License-Identifier: BSD-3-Clause
import pytest

from blackboard.domain.clock_offsets import ClockOffsets, words


def heard(*late):
    offsets = ClockOffsets()
    for each in late:
        offsets.hear("robot1", each, 0.0)
    return offsets.off(0.0)


@pytest.mark.parametrize("skew", [5.0, -5.0])
def test_a_clock_that_is_5_s_off_is_noticed_whatever_the_delays(skew):
    assert heard(*(skew + delay for delay in (0.3, 0.02, 2.0, 0.01, 0.5))) == {
        "robot1": pytest.approx(skew + 0.01)
    }


def test_messages_that_are_late_do_not_make_a_clock_wrong():
    assert heard(3.0, 2.0, 0.2, 4.0, 3.0, 3.0) == {}


def test_a_few_messages_prove_nothing():
    assert heard(5.0, 5.0, 5.0, 5.0) == {}


def test_a_clock_that_was_set_right_is_forgotten():
    assert heard(*[5.0] * 10, *[0.0] * 9, 0.0) == {}


def test_a_clock_ahead_is_told_from_one_behind():
    assert words(5.04) == "5.0 s behind"
    assert words(-5.04) == "5.0 s ahead of"


def test_who_has_left_is_not_named_any_more():
    offsets = ClockOffsets()
    for _ in range(10):
        offsets.hear("robot1", 5.0, 0.0)

    assert offsets.behind("robot1", 20.0) == 5.0
    assert offsets.behind("robot1", 40.0) == 0.0
    assert offsets.off(20.0) == {}
