# SPDX-License-Identifier: BSD-3-Clause
"""Keys that drive a robot."""

from __future__ import annotations

import pytest

from hive_navigation.mapping.teleop import HELD, Teleop


def agv() -> Teleop:
    return Teleop(1.0, 2.0, holonomic=False)


@pytest.mark.parametrize(
    ("key", "command"),
    [
        ("i", (0.5, 0.0, 0.0)),
        ("j", (0.0, 0.0, 1.0)),
        (",", (-0.5, 0.0, 0.0)),
        ("o", (0.5, 0.0, -1.0)),
        ("J", (0.0, 0.0, 0.0)),
        ("k", (0.0, 0.0, 0.0)),
    ],
)
def test_a_key_drives_the_robot(key: str, command: tuple[float, float, float]) -> None:
    teleop = agv()

    teleop.press(key, 10.0)

    assert teleop.command(10.1) == command


def test_only_a_holonomic_robot_goes_sideways() -> None:
    teleop = Teleop(1.0, 2.0, holonomic=True)

    teleop.press("J", 10.0)

    assert teleop.command(10.1) == (0.0, 0.5, 0.0)


def test_a_robot_stands_before_the_first_key_and_after_the_last_is_released() -> None:
    teleop = agv()
    before = teleop.command(0.0)
    teleop.press("i", 10.0)

    assert before == (0.0, 0.0, 0.0)
    assert teleop.command(10.0 + HELD + 0.01) == (0.0, 0.0, 0.0)


def test_any_other_key_stops_the_robot() -> None:
    teleop = agv()
    teleop.press("i", 10.0)
    teleop.press(" ", 10.1)

    assert teleop.command(10.2) == (0.0, 0.0, 0.0)


def test_speeds_change_up_to_the_robots_limits() -> None:
    teleop = agv()

    assert teleop.press("w", 0.0)
    assert (teleop.speed, teleop.turn) == pytest.approx((0.55, 1.0))
    for _ in range(50):
        teleop.press("q", 0.0)
    assert (teleop.speed, teleop.turn) == (1.0, 2.0)


def test_a_speed_changes_without_stopping_the_robot() -> None:
    teleop = agv()
    teleop.press("i", 10.0)
    teleop.press("q", 10.1)

    assert teleop.command(10.2) == pytest.approx((0.55, 0.0, 0.0))
