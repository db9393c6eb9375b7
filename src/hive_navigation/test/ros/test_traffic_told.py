# SPDX-License-Identifier: BSD-3-Clause
"""The messages that tell an operator about traffic."""

from __future__ import annotations

import pytest

pytest.importorskip("robot_description.msg", reason="these are generated messages")

from diagnostic_msgs.msg import DiagnosticStatus
from robot_description.msg import TrafficLock
from std_msgs.msg import Header

from hive_navigation.ros.traffic_report import LONG, Locked, TrafficReport, Waiting
from hive_navigation.ros.traffic_told import diagnostics_of, state_to_msg
from hive_navigation.traffic.deadlock import Kind, LockWatch
from hive_navigation.traffic.landmarks import Landmarks

CIRCLE = Locked(Kind.CIRCLE, ("robot1", "robot3"), 7.0, "robot1 waits for robot3 at the dock")


@pytest.fixture
def report():
    watch = LockWatch()
    watch.counts[Kind.HELD] = 3
    return TrafficReport(Landmarks(), watch)


def status(report):
    (told,) = diagnostics_of(report, 4, Header()).status
    return told


def test_all_kinds_of_locks_have_their_name_in_the_message():
    assert {kind.value for kind in Kind} == {
        TrafficLock.CIRCLE,
        TrafficLock.BLOCKED,
        TrafficLock.OVERTAKEN,
        TrafficLock.HELD,
    }


def test_traffic_that_flows_is_well(report):
    assert (status(report).level, status(report).message) == (
        DiagnosticStatus.OK,
        "nobody waits for long",
    )


def test_a_lock_is_a_warning_with_robots_and_places(report):
    report.locks = (CIRCLE,)
    told = status(report)

    assert told.level == DiagnosticStatus.WARN
    assert told.message == "cannot go on: robot1 waits for robot3 at the dock"


def test_a_long_wait_is_a_warning_with_the_place(report):
    report.note(LONG + 1.0, [Waiting("robot3", "robot1", 4.0, 2.5, 0.0)])
    told = status(report)

    assert told.level == DiagnosticStatus.WARN
    assert told.message.endswith("robot3 waits for robot1 at (4.0, 2.5)")


def test_a_place_that_a_robot_cannot_reach_is_a_warning_with_both_names(report):
    report.unreached = {
        "robot2": [],
        "robot3": ["dock"],
        "robot4": ["test cell", "dock"],
        "robot1": ["test cell", "dock"],
    }
    told = status(report)

    assert told.level == DiagnosticStatus.WARN
    assert told.message == (
        "robot1, robot4 cannot reach test cell, dock; robot3 cannot reach dock"
    )


def test_every_kind_is_counted(report):
    values = {value.key: value.value for value in status(report).values}

    assert values["held so far"] == "3"
    assert values["circle so far"] == "0"
    assert values["robots"] == "4"


def test_the_state_holds_locks_counts_and_what_is_out_of_reach(report):
    report.locks = (CIRCLE,)
    report.unreached = {"robot2": [], "robot1": ["dock"]}
    state = state_to_msg(report, 4001, ["robot1"], ["door"], [], Header())

    (lock,) = state.locks
    assert (lock.kind, lock.robots, lock.since) == ("circle", ["robot1", "robot3"], 7.0)
    assert (state.deadlocks, state.blocked, state.overtaken, state.held) == (0, 0, 0, 3)
    assert [(each.robot, each.places) for each in state.unreached] == [("robot1", ["dock"])]
