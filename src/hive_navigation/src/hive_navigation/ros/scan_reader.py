# SPDX-License-Identifier: BSD-3-Clause
"""Reads the scans of a robot's laser; what cannot be used is skipped, counted and told."""

from __future__ import annotations

import time
from collections import Counter
from typing import TYPE_CHECKING

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from robot_description.scan import Scan, ScanError

if TYPE_CHECKING:
    from collections.abc import Callable

    from sensor_msgs.msg import LaserScan

PERIOD = 1.0  # time between two diagnostics while scans are skipped [s, wall clock]


class ScanReader:
    """Reads scans from one topic.

    Attributes:
        flaw: What was wrong with the latest scan; empty if it could be used.
        skipped: How many could not be used, by the field that was wrong.

    ROS Publishers: `/diagnostics` (diagnostic_msgs/DiagnosticArray), from the first scan on that
        is skipped: WARN with topic and reason, at most 1 Hz, and OK when scans can be used again.
    """

    def __init__(self, topic: str, clock: Callable[[], float] = time.monotonic) -> None:
        """Read scans of a topic; the clock [s] must never jump."""
        self.flaw = ""
        self.skipped: Counter[str] = Counter()
        self._topic = topic
        self._clock = clock
        self._told_at: float | None = None  # None before the first scan that was skipped
        self._publisher: rospy.Publisher | None = None

    def read(self, msg: LaserScan) -> Scan | None:
        """Return a scan, or None if it cannot be used."""
        try:
            scan = Scan.from_msg(msg)
        except ScanError as error:
            self._skip(error)
            return None
        if self.flaw:
            self.flaw = ""
            self._tell(DiagnosticStatus.OK, f"scans on {self._topic} can be used again")
        return scan

    def _skip(self, error: ScanError) -> None:
        self.flaw = str(error)
        self.skipped[error.field] += 1
        if self._told_at is None or self._clock() - self._told_at >= PERIOD:
            self._tell(DiagnosticStatus.WARN, f"a scan on {self._topic} is skipped: {error}")

    def _tell(self, level: int, text: str) -> None:
        if self._publisher is None:
            self._publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._told_at = self._clock()
        if level != DiagnosticStatus.OK:
            rospy.logwarn_throttle_identical(10, text)
        status = DiagnosticStatus(
            level=level,
            name=f"{rospy.get_name().strip('/')}: {self._topic.strip('/')}",
            message=text,
            hardware_id="none",
            values=[KeyValue(f"skipped for {key}", str(n)) for key, n in self.skipped.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)
