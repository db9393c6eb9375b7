# SPDX-License-Identifier: BSD-3-Clause
"""Who carries the blackboard, as far as a desk can tell from the heartbeat."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.consensus.messages import Heartbeat
    from fleet_manager.desk.facts import Moment

SILENCE = 2.0  # [s, wall], the least that the hive itself takes for silence
FROZEN = 5.0  # [s, wall], how long the heartbeat's progress may stand still


class Standing(Enum):
    """Whether the hive has a blackboard."""

    NOBODY = "nobody"
    """None has been heard since the desk was opened."""
    LEADER = "active"
    """There is one."""
    SILENT = "silent"
    """There was one; its heartbeat has stopped."""
    STUCK = "stuck"
    """Its heartbeat goes on without progress."""


class Authority:
    """Follows the heartbeat.

    A heartbeat of a lower epoch comes from a blackboard that has been replaced and does not know
    yet; it counts for nothing while the newer one is heard. Once nobody is heard, any counts, so
    that a hive that was started anew is followed too.

    Attributes:
        heartbeat: The last one that counted; None before the first.
    """

    def __init__(self) -> None:
        self.heartbeat: Heartbeat | None = None
        self._heard = 0.0
        self._progressed = 0.0

    @property
    def epoch(self) -> int:
        """The epoch that is followed; 0 before the first heartbeat."""
        return self.heartbeat.epoch if self.heartbeat else 0

    def hear(self, beat: Heartbeat, now: Moment) -> bool:
        """Take a heartbeat in.

        Returns:
            Whether it counts.
        """
        before = self.heartbeat
        if before and beat.epoch < before.epoch and now.wall - self._heard < SILENCE:
            return False
        moved = before is None or (beat.epoch, beat.leader, beat.progress) != (
            before.epoch,
            before.leader,
            before.progress,
        )
        if moved:
            self._progressed = now.wall
        self.heartbeat, self._heard = beat, now.wall
        return True

    def silence(self, now: Moment) -> float:
        """Return for how long nothing has been heard [s]."""
        return now.wall - self._heard if self.heartbeat else 0.0

    def standing(self, now: Moment) -> Standing:
        """Return whether the hive has a blackboard now."""
        if self.heartbeat is None:
            return Standing.NOBODY
        if self.silence(now) >= SILENCE:
            return Standing.SILENT
        if now.wall - self._progressed >= FROZEN:
            return Standing.STUCK
        return Standing.LEADER
