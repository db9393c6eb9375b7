# SPDX-License-Identifier: BSD-3-Clause
"""Which process speaks for which robot and which member."""

from __future__ import annotations

import threading

from blackboard.consensus.member import name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, Heartbeat
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from hive_common.last_heard import LastHeard

SPEAKER_TIMEOUT = 5.0
"""A node that is silent for longer has given up its robot's name [s]; as long as the default of
`reassign`."""


class Speakers:
    """Refuses a second node that speaks for a robot while the first still does.

    It is thread-safe: a link may call back in several threads.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._heard = LastHeard[tuple[str, float]]()
        self._hosts = LastHeard[str]()  # of members that share a process with others

    def node_of(self, name: str) -> str:
        """Return the name of the node that speaks for a robot or a member; empty if unknown."""
        with self._lock:
            return self._hosts.get(name) or (self._heard.get(name) or ("", 0.0))[0]

    def why_refused(self, message: object, node: str, now: float) -> str:
        """Return why a message from a node is refused now [s]; empty if it is not.

        Only a robot's status and bids are checked.
        """
        if isinstance(message, Heartbeat | AppendEntries):
            self._note_host(message.leader, node, now)
        elif isinstance(message, AppendReply | Ballot):
            self._note_host(message.member, node, now)
        if not isinstance(message, RobotStatus | Bids):
            return ""
        if isinstance(message, RobotStatus) and message.state is RobotState.OFFLINE:
            return ""  # published by the blackboard, about the robot
        with self._lock:
            first, heard = self._heard.get(message.robot_id) or (node, now)
            if first != node and now - heard < SPEAKER_TIMEOUT:
                return (
                    f"{node} speaks as {message.robot_id[:64]}, which {first} does already; "
                    "give the robots names of their own"
                )
            self._heard.hear(message.robot_id, (node, now), now)
        return ""

    def _note_host(self, member: str, node: str, now: float) -> None:
        with self._lock:
            self._hosts.hear(name_of(member), node, now)
