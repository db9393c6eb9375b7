# SPDX-License-Identifier: BSD-3-Clause
"""Agrees among robots whose charger is whose, so that no two drive to the same one.

No one else can decide: the leader may change at any moment, and a charger is no task. So a robot
asks all others, and goes once every one of them has conceded (Ricart and Agrawala, "An optimal
algorithm for mutual exclusion in computer networks", CACM 24(1), 1981). It does not wait forever
for a robot that is gone: one that has been silent for longer than a lease lasts has stopped.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from hive_common.last_heard import FORGOTTEN_AFTER

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_common.pose import Pose

NEAR = 1.0
"""A robot that is this close to a charger is in the way of others there [m]."""


@dataclass(frozen=True, slots=True)
class Claim:
    """What one robot says about chargers (message ChargerClaim)."""

    robot_id: str  # who says it
    charger: str  # the charger that it claims, drives to or stands at; empty if none
    since: float  # when it claimed it, by its own clock [s]
    pose: Pose  # where it is [map frame]
    # For each robot whose claim it does not dispute, the `since` of that claim [s].
    conceded: tuple[tuple[str, float], ...] = ()


class Claims:
    """One robot's part in the agreement.

    `silence` in its methods is the time after which a robot that says nothing has stopped [s].

    Attributes:
        charger: What this robot claims or holds; empty if nothing.
        holds: Whether all others have conceded it.

    Args:
        chargers: Where a robot stands at each charger, by name [map frame].
        now: When it begins to listen [s].
    """

    def __init__(self, robot_id: str, chargers: Mapping[str, Pose], now: float) -> None:
        self._id = robot_id
        self._chargers = chargers
        self._listens_since = now
        self._others: dict[str, Claim] = {}
        self._heard: dict[str, float] = {}  # whoever was heard longest ago is first
        self._conceded: dict[str, float] = {}
        self._since = 0.0
        self.charger = ""
        self.holds = False

    def hear(self, claim: Claim, now: float) -> bool:
        """Take in what another robot says; drop the own claim if the other one goes first.

        Returns whether there is something new to tell that robot.
        """
        self._others[claim.robot_id] = claim
        self._heard.pop(claim.robot_id, None)
        self._heard[claim.robot_id] = now
        self._forget(now)
        if self._disputes(claim):
            return self._conceded.pop(claim.robot_id, None) is not None
        if claim.charger and claim.charger == self.charger:
            self.release()
        before = self._conceded.get(claim.robot_id)
        self._conceded[claim.robot_id] = claim.since
        return before != claim.since

    def free(self, now: float, silence: float) -> tuple[str, ...]:
        """Return the chargers that no robot claims or occupies.

        A robot that fell silent on its way has stopped there; one that fell silent at its charger
        is in the way.
        """
        taken = {
            other.charger
            for robot, other in self._others.items()
            if now - self._heard[robot] < silence or self._is_at_charger(other)
        }
        return tuple(name for name in self._chargers if name not in taken)

    def claim(self, charger: str, now: float, *, holds: bool = False) -> None:
        """Claim a charger; a robot that stands at it already holds it."""
        self.charger, self._since, self.holds = charger, now, holds

    def release(self) -> None:
        """Give up the charger that is claimed or held; harmless if there is none."""
        self.charger, self.holds = "", False

    def settle(self, now: float, silence: float) -> bool:
        """Return whether the claimed charger is this robot's by now.

        The robot has to listen for `silence` before it knows who else there is.
        """
        if not self.charger or now - self._listens_since < silence:
            return False
        asked = [name for name, heard in self._heard.items() if now - heard < silence]
        mine = (self._id, self._since)
        self.holds = self.holds or all(mine in self._others[name].conceded for name in asked)
        return self.holds

    def say(self, pose: Pose) -> Claim:
        """Return what to tell the others."""
        conceded = tuple(self._conceded.items())
        return Claim(self._id, self.charger, self._since, pose, conceded)

    def _forget(self, now: float) -> None:
        """Forget robots that have left, but not one that stands at a charger."""
        gone = []
        for name, heard in self._heard.items():
            if now - heard < FORGOTTEN_AFTER:
                break
            if not self._is_at_charger(self._others[name]):
                gone.append(name)
        for name in gone:
            del self._others[name], self._heard[name]
            self._conceded.pop(name, None)

    def _disputes(self, claim: Claim) -> bool:
        """Return whether a claim is on this robot's charger and goes after its own."""
        if not claim.charger or claim.charger != self.charger:
            return False
        return self.holds or self._id < claim.robot_id

    def _is_at_charger(self, other: Claim) -> bool:
        place = self._chargers.get(other.charger)
        return place is not None and other.pose.distance_to(place) <= NEAR
