# SPDX-License-Identifier: BSD-3-Clause
"""Makes the messages that tell an operator about traffic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32
from robot_description.msg import RobotWait, SlowPlace, TrafficLock, TrafficState, Unreached
from std_msgs.msg import Header

from hive_navigation.ros.traffic_report import LONG, out_of_reach
from hive_navigation.traffic.deadlock import Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hive_navigation.ros.traffic_report import TrafficReport


def state_to_msg(
    report: TrafficReport,
    epoch: int,
    robots: Sequence[str],
    zones: Sequence[str],
    closed: Sequence[str],
    header: Header,
) -> TrafficState:
    """Return the state of traffic as a message."""
    return TrafficState(
        header=header,
        epoch=epoch,
        robots=list(robots),
        zones=list(zones),
        closed=list(closed),
        waits=[
            RobotWait(
                wait.robot, wait.waits_for, Point32(wait.x, wait.y, 0.0), wait.since, wait.where
            )
            for wait in report.waits
        ],
        slowest=[
            SlowPlace(
                Point32(place.x, place.y, 0.0), place.waited, place.waits, place.where, place.delay
            )
            for place in report.slowest()
        ],
        deadlocks=report.counts[Kind.CIRCLE],
        locks=[
            TrafficLock(lock.kind.value, list(lock.robots), lock.since, lock.text)
            for lock in report.locks
        ],
        blocked=report.counts[Kind.BLOCKED],
        overtaken=report.counts[Kind.OVERTAKEN],
        held=report.counts[Kind.HELD],
        unreached=[Unreached(robot, places) for robot, places in _missing(report)],
    )


def diagnostics_of(report: TrafficReport, robots: int, header: Header) -> DiagnosticArray:
    """Return the health of traffic among a number of robots as a message."""
    level, text = _verdict(report)
    values = {
        "robots": robots,
        "waiting": len(report.waits),
        "waiting for long": len(report.standing()),
        "locks": len(report.locks),
        **{f"{kind.value} so far": report.counts[kind] for kind in Kind},
        "out of reach": sum(len(places) for _, places in _missing(report)),
    }
    status = DiagnosticStatus(
        level=level,
        name="hive: traffic",
        message=text,
        hardware_id="none",
        values=[KeyValue(key, str(value)) for key, value in values.items()],
    )
    return DiagnosticArray(Header(stamp=header.stamp), [status])


def _verdict(report: TrafficReport) -> tuple[int, str]:
    """Return the worst of what there is to tell."""
    if report.locks:
        text = "; ".join(lock.text for lock in report.locks)
        return DiagnosticStatus.WARN, f"cannot go on: {text}"
    standing = report.standing()
    if standing:
        text = "; ".join(
            f"{wait.robot} waits for {wait.waits_for} {wait.where}" for wait in standing
        )
        return DiagnosticStatus.WARN, f"for more than {LONG:g} s {text}"
    missing = out_of_reach(report.unreached)
    if missing:
        return DiagnosticStatus.WARN, "; ".join(missing)
    return DiagnosticStatus.OK, "nobody waits for long"


def _missing(report: TrafficReport) -> list[tuple[str, list[str]]]:
    """Return each robot that cannot reach a place, with the names of such places."""
    return sorted((robot, places) for robot, places in report.unreached.items() if places)
