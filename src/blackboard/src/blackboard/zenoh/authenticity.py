# SPDX-License-Identifier: BSD-3-Clause
"""Refuses what a process says in the name of another.

Zenoh sees to it that a message comes from the process that its key names. What the message itself
says about its sender must agree with that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.consensus.member import name_of
from blackboard.consensus.messages import AppendEntries, AppendReply, Ballot, Heartbeat
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from hive_common.last_heard import LastHeard

if TYPE_CHECKING:
    from collections.abc import Callable

_MOST_LETTERS = 64


class Authenticity:
    """Knows who leads, because only a leader may tell what other robots do.

    Args:
        hive: Namespace of the hive, ending in a slash.
        clock: Returns the time [s].
        leads_for: How long a heartbeat makes its sender a leader [s].
    """

    def __init__(self, hive: str, clock: Callable[[], float], leads_for: float = 10.0) -> None:
        self._hive = hive
        self._clock = clock
        self._leads_for = leads_for
        self._leaders = LastHeard[float]()

    def why_refused(self, value: object, sender: str) -> str:
        """Return why a process may not say this; empty if it may.

        Args:
            value: What it says.
            sender: The last part of the key on which it speaks.
        """
        if isinstance(value, Heartbeat | AppendEntries):
            return self._of_member(value.leader, sender) or self._note(sender)
        if isinstance(value, AppendReply | Ballot):
            return self._of_member(value.member, sender)
        if isinstance(value, Bids):
            return self._of_robot(value.robot_id, sender)
        if isinstance(value, RobotStatus):
            told = value.state is RobotState.OFFLINE and self._leads(sender)
            return "" if told else self._of_robot(value.robot_id, sender)
        if isinstance(value, TaskUpdate):
            return "" if self._leads(sender) else self._of_robot(value.robot_id, sender)
        return ""

    def _of_member(self, member: str, sender: str) -> str:
        name = name_of(member)
        own = name.removeprefix(self._hive).partition("/")[0]
        return "" if own == sender else _forged(name, sender)

    def _of_robot(self, robot: str, sender: str) -> str:
        return "" if robot == sender else _forged(robot, sender)

    def _note(self, sender: str) -> str:
        now = self._clock()
        self._leaders.hear(sender, now, now)
        return ""

    def _leads(self, sender: str) -> bool:
        heard = self._leaders.get(sender)
        return heard is not None and self._clock() - heard < self._leads_for


def _forged(name: str, sender: str) -> str:
    shown = name[:_MOST_LETTERS] or "nobody"
    return f"{sender} speaks as {shown}; a process speaks for its own robot only, by its name"
