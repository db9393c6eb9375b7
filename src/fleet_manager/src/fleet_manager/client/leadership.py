# SPDX-License-Identifier: BSD-3-Clause
"""Who is the leader, as far as the heartbeat tells."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from blackboard.consensus.messages import Heartbeat

SILENCE = 2.0  # [s, wall], the shortest that the hive itself takes for silence
FROZEN = 5.0  # [s, wall], how long the heartbeat's progress may stand still


class Standing(Enum):
    """Whether the hive has a blackboard."""

    NOBODY = "nobody"
    """No heartbeat has been heard yet."""
    LEADER = "active"
    """The leader's heartbeat is heard."""
    SILENT = "silent"
    """The heartbeat has stopped."""
    STUCK = "stuck"
    """The heartbeat goes on without progress."""


class Leadership:
    """Follows the heartbeat.

    A lower epoch of the same hive comes from a leader that has been replaced and does not know it
    yet, so it is ignored while the newer leader is heard. A hive that was bootstrapped anew has
    another id and counts its epochs from the start.
    """

    def __init__(self) -> None:
        self.heartbeat: Heartbeat | None = None  # the newest accepted one; None before the first
        self._heard = 0.0
        self._progressed = 0.0

    @property
    def epoch(self) -> int:
        """The current epoch; 0 before the first heartbeat."""
        return self.heartbeat.epoch if self.heartbeat else 0

    def hear(self, beat: Heartbeat, now: float) -> bool:
        """Take in a heartbeat at a time [s, wall]; return whether it is accepted."""
        before = self.heartbeat
        is_older = before and beat.hive == before.hive and beat.epoch < before.epoch
        if is_older and now - self._heard < SILENCE:
            return False
        if before is None or _progress(beat) != _progress(before):
            self._progressed = now
        self.heartbeat, self._heard = beat, now
        return True

    def silence(self, now: float) -> float:
        """Return the time since the last heartbeat [s]; 0 before the first."""
        return now - self._heard if self.heartbeat else 0.0

    def standing(self, now: float) -> Standing:
        """Return whether the hive has a blackboard at a time [s, wall]."""
        if self.heartbeat is None:
            return Standing.NOBODY
        if self.silence(now) >= SILENCE:
            return Standing.SILENT
        if now - self._progressed >= FROZEN:
            return Standing.STUCK
        return Standing.LEADER


def _progress(beat: Heartbeat) -> tuple[object, ...]:
    return beat.epoch, beat.leader, beat.progress
