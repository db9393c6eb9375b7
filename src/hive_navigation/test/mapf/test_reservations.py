# SPDX-License-Identifier: BSD-3-Clause
"""Who blocks what, when."""

from __future__ import annotations

import numpy as np
import pytest

from hive_navigation.mapf.conflicts import Conflicts
from hive_navigation.mapf.reservations import Reservations

NOTHING = Conflicts(np.zeros(1, dtype=np.intp), np.zeros(0, dtype=np.intp))
PLACE = np.zeros(1, dtype=np.intp)


@pytest.mark.parametrize("robots", [3, 64, 65, 3000])
def test_everybody_who_blocks_a_place_is_named_however_many_they_are(robots: int) -> None:
    reservations = Reservations(1, [[(NOTHING, NOTHING)]])
    for who in range(robots):
        reservations.block(who, 0, PLACE, float(who), who + 1.0)

    always = np.array([[0.0, robots]])
    assert reservations.blockers(0, PLACE, always).tolist() == list(range(robots))


def test_who_blocks_a_place_at_another_time_is_not_named() -> None:
    reservations = Reservations(1, [[(NOTHING, NOTHING)]])
    for who in range(4):
        reservations.block(who, 0, PLACE, float(who), who + 1.0)

    assert reservations.blockers(0, PLACE, np.array([[1.0, 3.0]])).tolist() == [1, 2]


def test_a_place_is_free_for_ever_after_the_last_who_blocks_it() -> None:
    reservations = Reservations(3, [[(NOTHING, NOTHING)]])
    reservations.block(0, 0, PLACE, 5.0, 9.0)
    reservations.block(1, 0, PLACE, 0.0, 20.0)
    reservations.block(2, 0, PLACE + 1, 3.0, np.inf)

    assert reservations.free_from(0).tolist() == [20.0, np.inf, -np.inf]


def test_what_actions_block_is_told_with_the_action_on_the_roadmap_and_with_ends() -> None:
    fixed = Conflicts(np.array([0, 2, 3]), np.array([4, 5, 6]))  # of two actions
    more = Conflicts(np.array([0, 0, 1, 3]), np.array([7, 8, 9]))  # of three
    reservations = Reservations(10, [[(fixed, more)]])

    rows, things = reservations.blocked(0, 0, np.array([2, 1, 0]))

    found = sorted(zip(rows.tolist(), things.tolist(), strict=True))
    assert found == [(0, 8), (0, 9), (1, 6), (1, 7), (2, 4), (2, 5)]
