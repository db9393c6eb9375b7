# SPDX-License-Identifier: BSD-3-Clause
"""A robot's leave to work, which it has to hear again and again.

A robot says with every status when it sent it, by its own clock. The active blackboard echoes that
time with its heartbeats, and from that time on the robot may work for `robot_lease`. A robot that
hears no echo stops before anyone may think that it has: the blackboard takes it for lost only
`reassign` after the last status that it echoed. Both count on their own clocks only, so the clocks
need not agree, and only have to run equally fast within `settings.MAX_DRIFT`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.consensus.messages import Heartbeat


MAX_EPOCH = 100_000
"""An epoch further ahead than this is no epoch of this hive but a fault of who sent it; who
believed it once would believe no real one ever again."""


class Lease:
    """The robot's side.

    Args:
        robot_id: Whose lease it is.
        now: The robot's time [s]; what it may have sent before is of an earlier life.
    """

    def __init__(self, robot_id: str, now: float) -> None:
        self._robot_id = robot_id
        self._begun = now
        self._epoch = 0
        self._length = math.inf
        self._end = -math.inf

    def renew(self, beat: Heartbeat, now: float) -> bool:
        """Take in a heartbeat; return whether the lease ends later because of it."""
        if beat.epoch < self._epoch or (self._epoch and beat.epoch > self._epoch + MAX_EPOCH):
            return False
        self._epoch = beat.epoch
        sent = beat.heard.get(self._robot_id)
        if sent is None or not self._begun <= sent <= now:
            return False
        self._length = beat.robot_lease
        before, self._end = self._end, max(self._end, sent + beat.robot_lease)
        return self._end > before

    def begin_anew(self, now: float) -> None:
        """Forget what was heard: the robot has gone over to a hive that counts its own epochs."""
        self._epoch, self._begun, self._end = 0, now, -math.inf

    def holds(self, now: float) -> bool:
        """Return whether the robot may work."""
        return now < self._end

    def remaining(self, now: float) -> float:
        """Return for how long it still may [s]; 0 when it may not."""
        return max(0.0, self._end - now)

    def is_echoed_within(self, patience: float, now: float) -> bool:
        """Return whether a status of the last while [s] has been echoed."""
        return now - (self._end - self._length) < patience

    def covers(self, heard: float, now: float) -> bool:
        """Return whether an order is recent: given while a lease from that echo would hold.

        Args:
            heard: The robot's own time [s] that the order echoes.
            now: The robot's time [s].
        """
        return self._begun <= heard <= now < heard + self._length


class Leases:
    """The blackboard's side: until when each robot may believe that it may work.

    Args:
        reassign: A robot is lost when its last echoed status is older than that [s].
        since: When this blackboard became the active one [s]; what its predecessor has echoed
            cannot be later.
    """

    def __init__(self, reassign: float, since: float) -> None:
        self._reassign = reassign
        self._since = since
        self._granted: dict[str, float] = {}

    def grant(self, robot_id: str, now: float) -> None:
        """Note that a status which has just been heard is going to be echoed."""
        self._granted[robot_id] = now

    def unheard_for(self, robot_id: str, now: float) -> float:
        """Return how long ago the last echoed status of a robot was heard [s]."""
        return now - self._granted.get(robot_id, self._since)

    def is_lost(self, robot_id: str, now: float) -> bool:
        """Return whether a robot has stopped by now, whatever it has heard."""
        return self.unheard_for(robot_id, now) > self._reassign
