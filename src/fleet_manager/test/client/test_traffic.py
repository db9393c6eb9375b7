# SPDX-License-Identifier: BSD-3-Clause
"""What a window tells of planned traffic."""

from dataclasses import replace

import pytest

from blackboard.domain.characteristics import RobotState, RobotStatus
from fleet_manager.client.hive_state import PLANNER_SILENCE, HiveState
from fleet_manager.client.traffic import LONG, Lock, RobotWait, TrafficState, traffic_change
from fleet_manager.client.words import Severity
from hive_common.pose import Pose

STATUS = RobotStatus("robot3", RobotState.BUSY, Pose(4.0, 2.5), 0.8)
FLOWS = TrafficState(epoch=4001, time=100.0, zones=("door",))
WAITS = replace(FLOWS, waits=(RobotWait("robot3", "robot1", 4.0, 2.5, 95.0, "at the north door"),))


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

    assert hive.robots["robot3"].reason == "waits for robot1 at the north door"
    assert hive.take_changes().robots == {"robot3"}


def test_it_still_waits_after_its_next_report(hive):
    hive.take_in(WAITS)
    hive.take_in(STATUS)

    assert hive.robots["robot3"].reason == "waits for robot1 at the north door"


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

    said = f"robot3 waits for robot1 at the north door for more than {LONG:g} s"
    assert [event.text for event in events] == [said]
    assert events[0].severity is Severity.WARNING


CIRCLE = Lock("circle", ("robot1", "robot3"), 95.0, "robot1 waits for robot3")
HELD = Lock("held", ("robot3",), 60.0, "robot3 stands at the north door")


@pytest.mark.parametrize("lock", [CIRCLE, HELD, replace(HELD, kind="blocked")])
def test_robots_that_cannot_go_on_are_told_once(hive, lock):
    for passed in range(3):
        hive.take_in(replace(FLOWS, time=100.0 + passed, locks=(lock,)))
    events = hive.take_changes().events

    assert [event.text for event in events] == [f"cannot go on: {lock.text}"]
    assert events[0].severity is Severity.WARNING


def test_another_planner_that_finds_the_same_lock_is_no_event(hive):
    hive.take_in(replace(FLOWS, locks=(CIRCLE,)))
    hive.take_changes()
    hive.take_in(replace(FLOWS, epoch=5001, locks=(CIRCLE,)))

    assert texts(hive) == []


def test_a_robot_that_is_held_says_where(hive):
    hive.take_in(replace(FLOWS, locks=(HELD,)))

    assert hive.robots["robot3"].reason == "stands at the north door"


def test_a_long_wait_of_a_robot_that_is_locked_is_not_told_twice(hive):
    hive.take_in(replace(WAITS, time=180.0, locks=(CIRCLE,)))

    assert texts(hive) == ["cannot go on: robot1 waits for robot3"]


def test_places_that_a_robot_cannot_reach_are_told_with_both_names():
    hive = HiveState()
    hive.take_in(replace(FLOWS, unreached={"robot1": ("test cell",)}))
    hive.take_in(replace(FLOWS, unreached={"robot1": ("dock", "test cell")}))

    assert [text for text in texts(hive) if "reach" in text] == [
        "robot1 cannot reach test cell",
        "robot1 cannot reach dock",
    ]


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


def test_it_is_told_once_that_no_traffic_is_planned_and_when_it_is_again():
    good = TrafficState(1, 0.0)
    bad = TrafficState(1, 1.0, status="it has ended (signal 9), and is started again in 1 s")

    told = [event.text for event in traffic_change(good, bad)]
    assert len(told) == 1
    assert "no traffic is planned now" in told[0]
    assert "signal 9" in told[0]
    assert [*traffic_change(bad, bad)] == []
    assert [event.text for event in traffic_change(bad, good)] == ["traffic is planned"]
