# SPDX-License-Identifier: BSD-3-Clause
"""Who blocks what, when."""

from __future__ import annotations

import numpy as np
import pytest

from robot_navigation.mapf.conflicts import Conflicts
from robot_navigation.mapf.reservations import Reservations

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
