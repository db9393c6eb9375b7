# SPDX-License-Identifier: BSD-3-Clause
"""When a drive is cancelled that its robot's process does not end."""

import math

from blackboard.robot.drive_guard import GRACE, Drive, DriveGuard

ONE, TWO = Drive("/robot1/move_base", "a"), Drive("/robot2/move_base", "b")


def test_a_drive_is_cancelled_once_soon_after_its_lease_has_ended():
    guard = DriveGuard()
    guard.hold(ONE, 10.0)

    assert guard.next_due == 10.0 + GRACE
    assert guard.due(10.0) == []
    assert guard.due(10.0 + GRACE) == [ONE]
    assert guard.due(99.0) == []


def test_a_drive_goes_on_as_long_as_its_lease_is_renewed():
    guard = DriveGuard()
    guard.hold(ONE, 10.0)
    guard.hold(ONE, 11.0)

    assert guard.due(10.5) == []
    assert guard.due(11.5) == [ONE]


def test_a_drive_that_has_ended_is_not_cancelled():
    guard = DriveGuard()
    guard.hold(ONE, 10.0)
    guard.drop(ONE)
    guard.drop(TWO)

    assert guard.next_due == math.inf
    assert guard.due(99.0) == []


def test_drives_of_several_robots_end_each_with_its_own_lease():
    guard = DriveGuard()
    guard.hold(ONE, 10.0)
    guard.hold(TWO, 12.0)

    assert guard.due(11.0) == [ONE]
    assert guard.next_due == 12.0 + GRACE


def test_what_still_drives_when_the_process_ends_is_left():
    guard = DriveGuard()
    guard.hold(ONE, 10.0)
    guard.hold(TWO, 12.0)

    assert guard.left() == [ONE, TWO]
    assert guard.left() == []
