# SPDX-License-Identifier: BSD-3-Clause
"""Agrees among robots whose charger is whose, so that two never drive to the same one.

There is nobody to ask: who carries the blackboard may change at any moment, and a charger is no
task. So a robot asks all others, and goes once every one of them has conceded (Ricart and
Agrawala, "An optimal algorithm for mutual exclusion in computer networks", CACM 24(1), 1981).
Instead of waiting for ever for a robot that is gone, it leaves out those that have been silent for
so long that they have lost their lease and stand still.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_common.pose import Pose

SILENCE = 5.0
"""A robot that has said nothing for so long has stopped: `BlackboardSettings.reassign` [s]."""

NEAR = 1.0
"""A robot that stands so near to a charger is in the way of others there [m]."""


@dataclass(frozen=True, slots=True)
class Claim:
    """What one robot says of chargers (message ChargerClaim).

    Attributes:
        robot_id: Who says it.
        charger: The charger that it claims, drives to or stands at; empty when none.
        since: When it began to claim it, by its own clock [s].
        pose: Where it stands [map frame].
        conceded: For each robot whose claim it does not dispute: the `since` of that claim [s].
    """

    robot_id: str
    charger: str
    since: float
    pose: Pose
    conceded: tuple[tuple[str, float], ...] = ()


class Claims:
    """One robot's part in the agreement.

    Attributes:
        charger: What this robot claims or holds; empty when nothing.
        holds: Whether all others have conceded it.

    Args:
        robot_id: Whose part it is.
        chargers: Where a robot stands at each charger, by name [map frame].
        now: The time [s]; it has to listen for `SILENCE` before it knows who else there is.
    """

    def __init__(self, robot_id: str, chargers: Mapping[str, Pose], now: float) -> None:
        self._id = robot_id
        self._chargers = chargers
        self._listens_since = now
        self._others: dict[str, Claim] = {}
        self._heard: dict[str, float] = {}
        self._conceded: dict[str, float] = {}
        self._since = 0.0
        self.charger = ""
        self.holds = False

    def hear(self, claim: Claim, now: float) -> bool:
        """Take in what another robot says, and drop the own claim where it goes before it.

        Returns:
            Whether there is something new to say to it.
        """
        self._others[claim.robot_id] = claim
        self._heard[claim.robot_id] = now
        if self._disputes(claim):
            return self._conceded.pop(claim.robot_id, None) is not None
        if claim.charger and claim.charger == self.charger:
            self.release()
        before = self._conceded.get(claim.robot_id)
        self._conceded[claim.robot_id] = claim.since
        return before != claim.since

    def free(self, now: float) -> tuple[str, ...]:
        """Return the chargers that no robot claims or stands at."""
        taken = {other.charger for other in self._others.values() if self._counts(other, now)}
        return tuple(name for name in self._chargers if name not in taken)

    def claim(self, charger: str, now: float, *, holds: bool = False) -> None:
        """Begin to claim a charger; a robot that stands at it already holds it."""
        self.charger, self._since, self.holds = charger, now, holds

    def release(self) -> None:
        """Give up the charger that is claimed or held; harmless when there is none."""
        self.charger, self.holds = "", False

    def settle(self, now: float) -> bool:
        """Return whether the charger that is claimed is this robot's by now."""
        if not self.charger or now - self._listens_since < SILENCE:
            return False
        asked = [name for name, heard in self._heard.items() if now - heard < SILENCE]
        mine = (self._id, self._since)
        self.holds = self.holds or all(mine in self._others[name].conceded for name in asked)
        return self.holds

    def say(self, pose: Pose) -> Claim:
        """Return what to tell the others."""
        conceded = tuple(self._conceded.items())
        return Claim(self._id, self.charger, self._since, pose, conceded)

    def _disputes(self, claim: Claim) -> bool:
        """Return whether a claim is on this robot's charger and comes after its own."""
        if not claim.charger or claim.charger != self.charger:
            return False
        return self.holds or self._id < claim.robot_id

    def _counts(self, other: Claim, now: float) -> bool:
        """Return whether what a robot last said still stands.

        A robot that fell silent on its way has stopped there; one that fell silent at the charger
        is in the way.
        """
        if not other.charger or other.charger not in self._chargers:
            return False
        place = self._chargers[other.charger]
        at_it = math.hypot(other.pose.x - place.x, other.pose.y - place.y) <= NEAR
        return at_it or now - self._heard[other.robot_id] < SILENCE
