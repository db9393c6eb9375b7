# SPDX-License-Identifier: BSD-3-Clause
"""Notices when two nodes speak as the same robot."""

from __future__ import annotations

from threading import Lock

from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus

SILENCE = 5.0
"""A node that was not heard for longer has given the robot's name up [s]; as long as it takes to
count a robot as lost by default."""


class Speakers:
    """Knows which node speaks as which robot: the one that came first, until it falls silent.

    For several threads: ROS hands messages over in one for each connection.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._heard: dict[str, tuple[str, float]] = {}

    def node_of(self, robot_id: str) -> str:
        """Return the name of the node that was heard last as a robot; empty where none was."""
        with self._lock:
            return self._heard.get(robot_id, ("", 0.0))[0]

    def why_refused(self, message: object, node: str, now: float) -> str:
        """Return why a message is not to be believed; empty where it is.

        Args:
            message: A robot's status or bids; everything else is believed.
            node: Who has sent it.
            now: The time [s].
        """
        if not isinstance(message, RobotStatus | Bids):
            return ""
        if isinstance(message, RobotStatus) and message.state is RobotState.OFFLINE:
            return ""  # said by the blackboard, about the robot
        with self._lock:
            first, heard = self._heard.get(message.robot_id, (node, now))
            if first != node and now - heard < SILENCE:
                return (
                    f"{node} speaks as {message.robot_id[:64]}, which {first} does already; "
                    "give the robots names of their own"
                )
            self._heard[message.robot_id] = (node, now)
        return ""
