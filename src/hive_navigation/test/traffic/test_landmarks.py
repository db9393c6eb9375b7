# SPDX-License-Identifier: BSD-3-Clause
"""People are told by name where robots are, and why they cannot go on."""

from __future__ import annotations

import pytest

from hive_common.landmark import Landmark
from hive_common.zone import Zone
from hive_navigation.traffic.deadlock import Kind, Lock
from hive_navigation.traffic.landmarks import AT, NEAR, Landmarks


def square(name, x, y, side):
    corners = ((x, y), (x + side, y), (x + side, y + side), (x, y + side))
    return Zone(name=name, kind="no-stopping", corners=corners)


LANDMARKS = Landmarks(
    [
        Landmark(name="the bench", at=(0.0, 0.0)),
        Landmark(name="the north door", at=(4.0, 0.0), is_goal=False),
    ],
    [square("the hall", -10.0, -1.0, 30.0), square("the aisle", 10.0, 0.0, 5.0)],
)


@pytest.mark.parametrize(
    ("point", "where"),
    [
        ((AT - 0.1, 0.0), "at the bench"),
        ((4.0, AT - 0.1), "at the north door"),
        ((11.0, 1.0), "in the aisle"),
        ((AT + 0.1, 0.0), "in the hall"),
        ((4.0, 1.1 - NEAR), "near the north door"),
        ((-20.04, 3.0), "at (-20.0, 3.0)"),
    ],
)
def test_a_place_is_told_by_the_landmark_or_zone_or_by_coordinates(point, where):
    assert LANDMARKS.where(point) == where


def test_without_landmarks_places_are_coordinates():
    assert Landmarks().where((4.04, 2.5)) == "at (4.0, 2.5)"


@pytest.mark.parametrize(
    ("kind", "robots", "words"),
    [
        (
            Kind.CIRCLE,
            ("a", "b"),
            "a waits for b at the bench, b waits for a at the north door",
        ),
        (
            Kind.BLOCKED,
            ("a", "b"),
            "a waits for b at the bench, b stands at the north door",
        ),
        (
            Kind.OVERTAKEN,
            ("a", "b", "c"),
            "a waits for b at the bench, b waits for c at the north door, c drives on",
        ),
        (Kind.HELD, ("a",), "a stands at the bench, and no robot holds it up"),
    ],
)
def test_a_lock_is_told_with_every_robot_and_its_place(kind, robots, words):
    at = ((0.0, 0.0), (4.0, 0.0), (11.0, 1.0))[: len(robots)]

    assert LANDMARKS.words_of(Lock(kind, robots, at, 0.0)) == words
