# SPDX-License-Identifier: BSD-3-Clause
"""Robot leases: a robot works only while the blackboard goes on hearing it.

With every status a robot says when it sent it, by its own clock. The leader echoes that time in
its heartbeats, and the robot may work for `robot_lease` after it. A robot that hears no echo stops
before the blackboard gives its tasks away: the blackboard considers it lost only `reassign` after
it received the last status that it echoed. Each side uses its own clock only. The clocks need not
agree, but have to run equally fast within `settings.MAX_DRIFT`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from blackboard.consensus.messages import MAX_EPOCH_JUMP

if TYPE_CHECKING:
    from blackboard.consensus.messages import Heartbeat


class Lease:
    """The robot's side.

    Args:
        robot_id: Whose lease it is.
        now: The robot's time [s]; echoes of earlier times are for an earlier process.
    """

    def __init__(self, robot_id: str, now: float) -> None:
        self._robot_id = robot_id
        self._begun = now
        self._epoch = 0
        self._length = math.inf
        self._end = -math.inf

    def renew(self, beat: Heartbeat, now: float) -> bool:
        """Handle a heartbeat; return whether it extends the lease."""
        if beat.epoch < self._epoch or (self._epoch and beat.epoch > self._epoch + MAX_EPOCH_JUMP):
            return False
        self._epoch = beat.epoch
        sent = beat.heard.get(self._robot_id)
        if sent is None or not self._begun <= sent <= now:
            return False
        self._length = beat.robot_lease
        before, self._end = self._end, max(self._end, sent + beat.robot_lease)
        return self._end > before

    def begin_anew(self, now: float) -> None:
        """Reset, because the robot has joined another hive, which has epochs of its own."""
        self._epoch, self._begun, self._end = 0, now, -math.inf

    def holds(self, now: float) -> bool:
        """Return whether the robot may work."""
        return now < self._end

    def remaining(self, now: float) -> float:
        """Return how long the robot may still work [s]; 0 if it may not."""
        return max(0.0, self._end - now)

    def is_echoed_within(self, patience: float, now: float) -> bool:
        """Return whether a status sent in the last `patience` [s] was echoed."""
        return now - (self._end - self._length) < patience

    def covers(self, heard: float, now: float) -> bool:
        """Return whether an order is recent: a lease renewed by its echo would still hold.

        `heard` is the robot's own time [s] that the order echoes.
        """
        return self._begun <= heard <= now < heard + self._length


class Leases:
    """The blackboard's side.

    Args:
        reassign: A robot is lost when its last echoed status is older than this [s].
        since: When this blackboard became the leader [s]; its predecessor echoed nothing later.
    """

    def __init__(self, reassign: float, since: float) -> None:
        self._reassign = reassign
        self._since = since
        self._granted: dict[str, float] = {}

    def grant(self, robot_id: str, now: float) -> None:
        """Note that a status was received, and will be echoed."""
        self._granted[robot_id] = now

    def forget(self, robot_id: str) -> None:
        """Forget a robot that has left."""
        self._granted.pop(robot_id, None)

    def unheard_for(self, robot_id: str, now: float) -> float:
        """Return how long ago the last echoed status of a robot was received [s]."""
        return now - self._granted.get(robot_id, self._since)

    def is_lost(self, robot_id: str, now: float) -> bool:
        """Return whether a robot must have stopped by now, whatever it has heard."""
        return self.unheard_for(robot_id, now) > self._reassign
