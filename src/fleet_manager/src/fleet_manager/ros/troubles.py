# SPDX-License-Identifier: BSD-3-Clause
"""What the hive's members and nodes say is wrong, for windows and commands.

Members tell it on /diagnostics while they run; a node that refused to start has left its reason
with the ROS master.
"""

from __future__ import annotations

import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from hive_common.ros.refusal import refusals

_OURS = ": hive"
"""How the names of the members' statuses end."""

_FRESH = 5.0
"""A member tells its state once a second; what is older than this is no news [s]."""


class Troubles:
    """Listens to /diagnostics (diagnostic_msgs/DiagnosticArray)."""

    def __init__(self) -> None:
        self._errors: dict[str, tuple[float, str]] = {}
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._hear, queue_size=100)

    def read(self) -> tuple[str, ...]:
        """Return what is wrong now, in sentences; what kept nodes from starting comes first.

        It asks the ROS master, and waits for its answer.
        """
        now = time.monotonic()
        refused = [f"{node} did not start: {reason}" for node, reason in refusals().items()]
        errors = self._errors.copy().values()  # a thread of rospy's changes them
        texts = {text for heard, text in errors if now - heard < _FRESH}
        # A member that knows the others says more than one that has met nobody yet.
        return (*refused, *sorted(texts, key=len, reverse=True))

    def _hear(self, msg: DiagnosticArray) -> None:
        for status in msg.status:
            if status.name.endswith(_OURS) and status.level == DiagnosticStatus.ERROR:
                self._errors[status.name] = time.monotonic(), status.message
            else:
                self._errors.pop(status.name, None)
