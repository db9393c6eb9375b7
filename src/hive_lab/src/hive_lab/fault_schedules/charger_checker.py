# SPDX-License-Identifier: BSD-3-Clause
"""Checks that no two robots of one hive share a charger."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blackboard.domain.charger import Grant
    from hive_common.pose import Pose
    from hive_lab.fault_schedules.simulated_member import SimulatedMember


class ChargerChecker:
    """Follows who drives to a charger, and who stands at one as the hive knows.

    A robot that arrives after the hive has lost it stands where nobody knows it to be. Another may
    drive there, and finds the charger occupied.

    Args:
        members: All members, by name.
        broken: Ends the run; takes the broken property and the observation.
    """

    def __init__(
        self, members: Mapping[str, SimulatedMember], broken: Callable[[str, str], NoReturn]
    ) -> None:
        self._members = members
        self._broken = broken
        self._heading: dict[str, Pose] = {}
        self._last: dict[str, float] = {}  # `since` of the last grant to each robot
        self._over: dict[str, float] = {}  # and of the last before it set off
        self._there: dict[str, str] = {}  # where each robot stands, as a list has shown

    def listed(self, grants: Mapping[str, Grant]) -> None:
        """Record what a committed list shows."""
        for each in grants.values():
            self._last[each.robot] = max(each.since, self._last.get(each.robot, 0.0))
            if each.there and each.since > self._over.get(each.robot, 0.0):
                self._there[each.robot] = each.charger

    def heads_for(self, robot: str, goal: Pose | None) -> None:
        """Record where a base begins to drive; None when it stops."""
        if goal is None:
            self._heading.pop(robot, None)
            return
        self._heading[robot] = goal
        self._there.pop(robot, None)
        self._over[robot] = self._last.get(robot, 0.0)
        chargers = self._members[robot].kit.charging.chargers
        charger = next((name for name, pose in chargers.items() if pose == goal), None)
        if charger is None:
            return
        for other in self._members:
            if other == robot or self._hive_of(other) != self._hive_of(robot):
                continue
            at = self._heading.get(other)
            if at == goal:
                self._say(f"{robot} drives to {charger}, as {other} does")
            is_known = self._there.get(other) == charger
            if is_known and at is None and self._members[other].pose == goal:
                self._say(f"{robot} drives to {charger}, where {other} stands")

    def _say(self, what: str) -> None:
        self._broken("one charger, one robot", what)

    def _hive_of(self, robot: str) -> str:
        known = self._members[robot].disk.hard_state
        return "" if known is None else known.hive
