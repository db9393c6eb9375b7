# SPDX-License-Identifier: BSD-3-Clause
"""Makes the messages that tell an operator about traffic."""

from __future__ import annotations

from typing import TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32
from robot_description.msg import RobotWait, SlowPlace, TrafficState
from std_msgs.msg import Header

from robot_navigation.ros.traffic_report import LONG

if TYPE_CHECKING:
    from collections.abc import Sequence

    from robot_navigation.ros.traffic_report import TrafficReport, Waiting


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
            RobotWait(wait.robot, wait.waits_for, Point32(wait.x, wait.y, 0.0), wait.since)
            for wait in report.waits
        ],
        slowest=[
            SlowPlace(Point32(place.x, place.y, 0.0), place.waited, place.waits)
            for place in report.slowest()
        ],
        deadlocks=report.deadlocks,
    )


def diagnostics_of(report: TrafficReport, robots: int, header: Header) -> DiagnosticArray:
    """Return the health of traffic among a number of robots as a message."""
    level, text = _verdict(report)
    values = {
        "robots": robots,
        "waiting": len(report.waits),
        "waiting for long": len(report.standing()),
        "cycles": len(report.cycles),
        "cycles so far": report.deadlocks,
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
    if report.cycles:
        names = "; ".join(", ".join(sorted(each)) for each in sorted(report.cycles, key=sorted))
        return DiagnosticStatus.WARN, f"robots wait for each other: {names}"
    standing = report.standing()
    if standing:
        text = "; ".join(map(_waits, standing))
        return DiagnosticStatus.WARN, f"for more than {LONG:g} s {text}"
    return DiagnosticStatus.OK, "nobody waits for long"


def _waits(wait: Waiting) -> str:
    return f"{wait.robot} waits for {wait.waits_for} at ({wait.x:.1f}, {wait.y:.1f})"
