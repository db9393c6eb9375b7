# SPDX-License-Identifier: BSD-3-Clause
"""Names that have left are forgotten, and only those."""

from __future__ import annotations

from hive_common.last_heard import FORGOTTEN_AFTER, LastHeard


def test_a_name_is_known_by_what_was_heard_last() -> None:
    heard = LastHeard[int]()
    heard.hear("robot1", 1, 0.0)
    heard.hear("robot1", 2, 1.0)

    assert heard.get("robot1") == 2
    assert heard.get("robot2") is None


def test_who_is_silent_for_long_is_forgotten_and_who_speaks_is_not() -> None:
    heard = LastHeard[int]()
    heard.hear("gone", 1, 0.0)
    heard.hear("there", 2, 0.0)
    heard.hear("there", 3, 1.0)

    assert heard.hear("other", 4, FORGOTTEN_AFTER - 0.5) == []
    assert heard.hear("other", 5, FORGOTTEN_AFTER) == [1]
    assert (heard.get("gone"), heard.get("there"), heard.get("other")) == (None, 3, 5)


def test_names_that_come_and_go_take_no_more_room() -> None:
    heard = LastHeard[int]()
    for number in range(1000):
        heard.hear(f"robot{number}", number, number * FORGOTTEN_AFTER / 10)

    assert len(heard) == 10


def test_who_was_heard_before_the_clock_was_set_back_is_forgotten() -> None:
    heard = LastHeard[int]()
    heard.hear("before", 1, 2 * FORGOTTEN_AFTER)

    assert heard.hear("after", 2, 0.0) == [1]
