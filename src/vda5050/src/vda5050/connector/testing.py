# SPDX-License-Identifier: BSD-3-Clause
"""For tests: a robot's navigation and arm that do what the test says, on virtual time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hive_common.pose import STOP, Pose, Velocity
from vda5050.vehicle.ports import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable


class FakeNavigation:
    """A robot that drives straight to its goal at 1 m/s, or is told how the goal ends."""

    def __init__(self, pose: Pose) -> None:
        self.pose: Pose | None = pose
        self.velocity: Velocity = STOP
        self.outcome: Outcome | None = None
        self.goals: list[Pose] = []
        self.blocked = ""  # why every goal fails; empty: they are reached
        self.is_localized_by_hand = True
        self.heeds_limits = True
        self.speed = 1.0  # as it drives on its own [m/s]
        self.limit: float | None = None
        self._goal: Pose | None = None

    def send(self, goal: Pose) -> None:
        """Drive to a goal."""
        self.goals.append(goal)
        self._goal, self.outcome = goal, None

    def cancel(self) -> None:
        """Stop."""
        self._goal, self.velocity = None, STOP

    def limit_speed(self, limit: float | None) -> bool:
        """Drive no faster [m/s], if that is possible."""
        self.limit = limit if self.heeds_limits else None
        return self.heeds_limits

    def set_pose(self, pose: Pose) -> bool:
        """Be somewhere else, if there is a localization to tell."""
        if self.is_localized_by_hand:
            self.pose = pose
        return self.is_localized_by_hand

    def step(self, seconds: float) -> None:
        """Let time pass [s]."""
        if self._goal is None or self.pose is None:
            return
        if self.blocked:
            self._goal, self.velocity = None, STOP
            self.outcome = Outcome(done=False, text=self.blocked)
            return
        left = self.pose.distance_to(self._goal)
        speed = min(self.speed, self.limit or self.speed)
        if left <= seconds * speed:
            self.pose, self._goal, self.velocity = self._goal, None, STOP
            self.outcome = Outcome(done=True)
            return
        share = seconds * speed / left
        x = self.pose.x + share * (self._goal.x - self.pose.x)
        y = self.pose.y + share * (self._goal.y - self.pose.y)
        self.pose, self.velocity = Pose(x, y, self._goal.yaw), Velocity(speed)


class FakeArm:
    """An arm whose orders end when the test says so."""

    def __init__(self) -> None:
        self.orders: list[tuple[bool, str, float]] = []  # picks, task id, payload
        self.cancelled = 0
        self._done: Callable[[Outcome], None] | None = None

    def start(
        self, *, picks: bool, task_id: str, payload: float, done: Callable[[Outcome], None]
    ) -> None:
        """Begin an order."""
        self.orders.append((picks, task_id, payload))
        self._done = done

    @property
    def is_busy(self) -> bool:
        """Whether an order is under way."""
        return self._done is not None

    def cancel(self) -> None:
        """Drop the order."""
        self.cancelled += 1
        self._done = None

    def end(self, *, done: bool, text: str = "") -> None:
        """End the order that is under way."""
        if self._done is None:
            raise ValueError("there is no order to end")
        told, self._done = self._done, None
        told(Outcome(done, text))
