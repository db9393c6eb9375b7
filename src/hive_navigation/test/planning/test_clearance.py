# SPDX-License-Identifier: BSD-3-Clause
"""Clearances: how much room there is, with and without further obstacles."""

from __future__ import annotations

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_navigation.planning.clearance import FAR, ClearanceField, Disc


def hall(blocked_columns: slice = slice(0, 0)) -> ClearanceField:
    """Return the field of a hall of 10 m x 4 m with a wall across some columns."""
    blocked = np.zeros((80, 200), dtype=bool)
    blocked[:, blocked_columns] = True
    return ClearanceField.of(GridMap.of_blocked(blocked, 0.05))


def test_clearance_is_the_distance_to_the_wall() -> None:
    field = hall(slice(100, 104))

    assert field.at(4.025, 2.025) == pytest.approx(0.975, abs=0.03)


def test_the_edge_of_the_map_is_a_wall() -> None:
    assert hall().at(5.0, 0.525) == pytest.approx(0.525, abs=0.03)


def test_there_is_no_room_off_the_map() -> None:
    field = hall()

    assert field.at(-1.0, 2.0) == 0.0
    assert field.at_points(np.array([[5.0, 99.0], [5.0, 2.0]])).tolist() == [
        0.0,
        pytest.approx(field.at(5.0, 2.0)),
    ]


def test_a_disc_lowers_clearances_in_a_copy_of_the_field() -> None:
    field = hall()
    around = field.with_discs([Disc(5.0, 2.0, 0.3)])

    assert around.at(6.025, 2.025) == pytest.approx(0.725, abs=0.03)
    assert field.at(5.0, 2.0) > 1.9


def test_clearances_have_a_maximum() -> None:
    assert (
        ClearanceField.of(GridMap.of_blocked(np.zeros((400, 400), bool), 0.05)).at(10, 10) == FAR
    )


def test_a_line_through_a_wall_is_not_clear() -> None:
    field = hall(slice(100, 104))

    assert field.line_is_clear((1.0, 2.0), (4.0, 2.0), 0.5)
    assert not field.line_is_clear((1.0, 2.0), (8.0, 2.0), 0.5)


def test_many_lines_get_the_same_answers_as_each_alone_in_both_directions() -> None:
    random = np.random.default_rng(3)
    field = hall(slice(100, 104)).with_discs([Disc(2.5, 2.0, 0.4), Disc(7.5, 1.0, 0.2)])
    a = random.uniform((0.0, 0.0), (10.0, 4.0), (300, 2))
    b = random.uniform((0.0, 0.0), (10.0, 4.0), (300, 2))

    alone = [field.line_is_clear(tuple(p), tuple(q), 0.35) for p, q in zip(a, b, strict=True)]

    assert field.lines_are_clear(a, b, 0.35).tolist() == alone
    assert field.lines_are_clear(b, a, 0.35).tolist() == alone
    assert any(alone)
    assert not all(alone)
