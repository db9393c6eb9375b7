# SPDX-License-Identifier: BSD-3-Clause
"""What a window tells of planned traffic."""

from dataclasses import replace

import pytest

from blackboard.domain.characteristics import RobotState, RobotStatus
from fleet_manager.client.hive_state import PLANNER_SILENCE, HiveState
from fleet_manager.client.traffic import LONG, RobotWait, TrafficState
from fleet_manager.client.words import Severity
from hive_common.pose import Pose

STATUS = RobotStatus("robot3", RobotState.BUSY, Pose(4.0, 2.5), 0.8)
FLOWS = TrafficState(epoch=4001, time=100.0, zones=("door",))
WAITS = replace(FLOWS, waits=(RobotWait("robot3", "robot1", 4.0, 2.5, 95.0),))


@pytest.fixture
def hive():
    hive = HiveState()
    hive.take_in(STATUS)
    hive.take_in(FLOWS)
    hive.take_changes()
    return hive


def texts(hive):
    return [event.text for event in hive.take_changes().events]


def test_a_robot_that_waits_says_for_whom_and_where(hive):
    hive.take_in(WAITS)

    assert hive.robots["robot3"].reason == "waits for robot1 at (4.0, 2.5)"
    assert hive.take_changes().robots == {"robot3"}


def test_it_still_waits_after_its_next_report(hive):
    hive.take_in(WAITS)
    hive.take_in(STATUS)

    assert hive.robots["robot3"].reason == "waits for robot1 at (4.0, 2.5)"


def test_a_reason_of_its_own_comes_first(hive):
    hive.take_in(replace(STATUS, reason="hands T1 back"))
    hive.take_in(WAITS)

    assert hive.robots["robot3"].reason == "hands T1 back"


def test_a_robot_that_drives_on_no_longer_waits(hive):
    hive.take_in(WAITS)
    hive.take_in(FLOWS)

    assert hive.robots["robot3"].reason == ""


def test_a_short_wait_is_no_event_and_a_long_one_is_one(hive):
    for passed in range(80):
        hive.take_in(replace(WAITS, time=100.0 + passed))
    events = hive.take_changes().events

    said = f"robot3 waits for robot1 at (4.0, 2.5) for more than {LONG:g} s"
    assert [event.text for event in events] == [said]
    assert events[0].severity is Severity.WARNING


def test_a_circle_of_waiting_robots_is_told(hive):
    hive.take_in(replace(WAITS, deadlocks=1))

    assert texts(hive) == ["robots wait for each other in a circle, among robot3"]


def test_circles_that_another_planner_has_counted_are_not_told_again(hive):
    hive.take_in(replace(FLOWS, epoch=5001, deadlocks=3))

    assert texts(hive) == []


def test_zones_that_close_and_open_are_told(hive):
    hive.take_in(replace(FLOWS, closed=("door",)))
    hive.take_in(FLOWS)

    assert texts(hive) == ["zone door was closed", "zone door was opened"]


def test_what_an_earlier_planner_says_late_changes_nothing(hive):
    hive.take_in(replace(WAITS, epoch=3001))

    assert hive.traffic == FLOWS


def test_of_a_planner_that_is_silent_nothing_is_shown_any_more(hive):
    hive.take_in(WAITS, now=50.0)
    hive.take_changes()
    hive.tick(50.0 + PLANNER_SILENCE + 0.1)
    hive.tick(50.0 + PLANNER_SILENCE + 9.0)

    assert hive.robots["robot3"].waits == ""
    assert [text for text in texts(hive) if "planner" in text] == [
        "the traffic planner is silent; robots drive by right of way"
    ]
    hive.take_in(replace(FLOWS, epoch=1001), now=90.0)
    assert hive.traffic is not None
