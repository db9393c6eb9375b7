# SPDX-License-Identifier: BSD-3-Clause
"""Which robots there are, by their last status."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState

if TYPE_CHECKING:
    from blackboard.domain.characteristics import RobotStatus

_CHARGE_STEP = 0.05
"""A robot that has charged by this much may now take what it refused before."""


@dataclass(frozen=True, slots=True)
class _Seen:
    status: RobotStatus
    heard: float
    charge: float


class Presence:
    """Keeps the last status of every robot.

    Args:
        timeout: A robot that is silent for longer counts as offline [s].
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._seen: dict[str, _Seen] = {}
        self._in_service: frozenset[str] = frozenset()

    def hear(self, status: RobotStatus, now: float) -> bool:
        """Note a status; return whether the robot may now bid better than before."""
        before = self._seen.get(status.robot_id)
        known_charge = status.charge if before is None else before.charge
        charged = status.charge - known_charge >= _CHARGE_STEP
        charge = status.charge if charged else min(status.charge, known_charge)
        self._note(_Seen(status, now, charge))
        if before is None:
            return status.state.in_service
        returned = status.state.in_service and not before.status.state.in_service
        relieved = not set(before.status.tasks) <= set(status.tasks)
        return returned or relieved or charged

    def knows(self, robot_id: str) -> bool:
        """Return whether a robot was ever heard."""
        return robot_id in self._seen

    def in_service(self) -> frozenset[str]:
        """Return the names of the robots that take tasks."""
        return self._in_service

    def last(self, robot_id: str) -> RobotStatus | None:
        """Return the last status of a robot; None if it was never heard."""
        seen = self._seen.get(robot_id)
        return None if seen is None else seen.status

    def fall_silent(self, now: float) -> tuple[RobotStatus, ...]:
        """Mark robots as offline that are silent for too long; return those just marked."""
        fallen = tuple(
            replace(
                seen.status,
                state=RobotState.OFFLINE,
                reason=f"not heard of for {now - seen.heard:.0f} s",
            )
            for seen in self._seen.values()
            if now - seen.heard > self._timeout and seen.status.state is not RobotState.OFFLINE
        )
        for status in fallen:
            self._note(replace(self._seen[status.robot_id], status=status))
        return fallen

    def _note(self, seen: _Seen) -> None:
        name = seen.status.robot_id
        self._seen[name] = seen
        if seen.status.state.in_service != (name in self._in_service):
            self._in_service ^= {name}
