# SPDX-License-Identifier: BSD-3-Clause
"""Which robots there are, and when one of them may bid better than before."""

from dataclasses import replace

import pytest

from blackboard.board.watch import Presence
from blackboard.domain.characteristics import RobotState, RobotStatus
from hive_common.last_heard import FORGOTTEN_AFTER
from hive_common.map_id import MapId
from hive_common.pose import Pose

IDLE = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, 0.0), charge=0.5)
TIMEOUT = 5.0


def changes(*statuses):
    """Return for each of some statuses, one a second, whether the robot may bid better."""
    presence = Presence(TIMEOUT)
    return [presence.hear(status, float(now)) for now, status in enumerate(statuses)]


def test_a_robot_that_takes_tasks_is_in_service():
    presence = Presence(TIMEOUT)
    presence.hear(IDLE, 0.0)
    presence.hear(replace(IDLE, robot_id="robot2", state=RobotState.BUSY), 0.0)
    presence.hear(replace(IDLE, robot_id="robot3", state=RobotState.DEFECT), 0.0)
    presence.hear(replace(IDLE, robot_id="robot4", state=RobotState.CHARGING), 0.0)

    assert presence.in_service() == {"robot1", "robot2"}


def test_a_robot_whose_lease_is_lost_is_in_service_again_when_it_has_one():
    presence = Presence(TIMEOUT)
    heard = [presence.hear(IDLE, float(now), is_lost=now < 2) for now in range(4)]

    assert heard == [False, False, True, False]
    assert presence.in_service() == {"robot1"}


def test_a_new_robot_may_bid_better_if_it_is_in_service():
    assert changes(IDLE) == [True]
    assert changes(replace(IDLE, state=RobotState.DEFECT)) == [False]


def test_a_repeated_status_changes_nothing():
    assert changes(IDLE, IDLE, IDLE) == [True, False, False]


@pytest.mark.parametrize("out", [RobotState.DEFECT, RobotState.CHARGING])
def test_a_robot_may_bid_better_when_it_returns_to_service_but_not_when_it_leaves(out):
    assert changes(IDLE, replace(IDLE, state=out), IDLE) == [True, False, True]


def test_a_robot_may_bid_better_on_another_map():
    on_new_map = replace(IDLE, map=MapId("hall", "02"))

    assert changes(IDLE, on_new_map, on_new_map) == [True, True, False]


def test_a_robot_may_bid_better_when_it_loses_a_task_but_not_when_it_gets_one():
    one, two = replace(IDLE, tasks=("T1",)), replace(IDLE, tasks=("T1", "T2"))

    assert changes(IDLE, one, two, one, IDLE) == [True, False, False, True, True]


def test_a_lost_task_is_noticed_even_if_another_came():
    assert changes(replace(IDLE, tasks=("T1",)), replace(IDLE, tasks=("T2",))) == [True, True]


def test_only_a_substantial_charge_is_a_change():
    levels = [0.50, 0.54, 0.56, 0.60, 0.62]

    assert changes(*(replace(IDLE, charge=level) for level in levels)) == [
        True,
        False,
        True,
        False,
        True,
    ]


def test_charging_counts_from_the_lowest_level():
    levels = [0.50, 0.20, 0.24, 0.26]

    assert changes(*(replace(IDLE, charge=level) for level in levels)) == [
        True,
        False,
        False,
        True,
    ]


def test_a_robot_that_is_silent_for_too_long_is_offline_until_it_is_heard():
    presence = Presence(TIMEOUT)
    presence.hear(IDLE, 0.0)

    assert not presence.silent(5.0)
    offline = replace(IDLE, state=RobotState.OFFLINE)
    assert presence.silent(5.1) == (replace(offline, reason="not heard for 5 s"),)
    assert presence.silent(35.0) == (replace(offline, reason="not heard for 35 s"),)
    assert not presence.in_service()
    presence.hear(IDLE, 36.0)
    assert not presence.silent(37.0)


def test_a_robot_that_is_heard_again_is_back_in_service():
    presence = Presence(TIMEOUT)
    presence.hear(IDLE, 0.0)
    presence.silent(6.0)

    assert presence.hear(IDLE, 7.0)
    assert presence.in_service() == {"robot1"}


def test_a_robot_that_has_left_is_forgotten_unless_it_holds_a_task():
    presence = Presence(TIMEOUT)
    for name in ("left", "holder"):
        presence.hear(replace(IDLE, robot_id=name), 0.0)
    presence.hear(replace(IDLE, robot_id="there"), 1.0)

    assert presence.forget(FORGOTTEN_AFTER - 0.1, {"holder"}) == ()
    assert presence.forget(FORGOTTEN_AFTER, {"holder"}) == ("left",)
    assert [presence.knows(name) for name in ("left", "holder", "there")] == [False, True, True]
    assert presence.in_service() == {"holder", "there"}
