# SPDX-License-Identifier: BSD-3-Clause
"""Whether a robot is in service, and which load was left on board."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState

if TYPE_CHECKING:
    from hive_common.pose import Pose

WORDS = ("idle", "defect", "charging", "charge")
"""What an operator can tell a robot: to be in service, out of service, or charging where it
stands, or to go to a charger."""

PUT_DOWN = "put_down"
"""Before `x y yaw` [m, m, rad, map frame], tells it to put a load down there that was left."""


def put_down_word(place: Pose) -> str:
    """Return the word that sends a robot to put its load down at a place [map frame]."""
    return f"{PUT_DOWN} {place.x:.3f} {place.y:.3f} {place.yaw:.4f}"


class Service:
    """Whether a robot is out of service, with the reason in words.

    A robot with a load that nobody wants leaves service until a person has seen to it.

    Attributes:
        state: DEFECT or CHARGING while out of service, otherwise None.
        reason: Why it is out of service; empty otherwise.
        left_on_board: The load that was left on board [kg]; None if none was.
        is_sure: Whether that load is known, and not only to the arm.
        is_on_its_own: Whether it left service by itself to charge, not because of a person.
    """

    def __init__(self) -> None:
        self.state: RobotState | None = None
        self.reason = ""
        self.left_on_board: float | None = None
        self.is_sure = False
        self._was_in_service = False
        self.is_on_its_own = False
        self._trouble = ""

    def set(self, word: str) -> None:
        """Be set `idle`, `defect` or `charging`; `idle` says too that nothing is on board."""
        self.is_on_its_own = False
        self._trouble = ""
        if word == "idle":
            self.state, self.reason, self.left_on_board = None, "", None
            return
        self.state = RobotState[word.upper()]
        if self.left_on_board is None:
            self.reason = f"{word}, set by an operator"
        elif word == "defect":
            self._was_in_service = False  # so it stays out when the load is down

    def leave_on_board(self, task_id: str, payload: float) -> None:
        """Leave service because of a load [kg] that is on board and no longer wanted."""
        self._leave(payload)
        self.is_sure = True
        self.reason = (
            f"the load of {task_id} ({payload:g} kg) is on board: send the robot to put it down, "
            "or take it off, then set the robot idle"
        )

    def leave_unknown_on_board(self, what: str) -> None:
        """Leave service because of a load on board of which only the arm knows, in words."""
        self._leave(self.left_on_board or 0.0)
        self.is_sure = False
        self.reason = f"{what}: take it off, then set the robot idle"

    def unload(self) -> None:
        """Come back into service without a load, unless the robot was out of it before."""
        self.left_on_board = None
        self.set("idle" if self._was_in_service else "defect")

    def _leave(self, payload: float) -> None:
        if self.left_on_board is None:
            self._was_in_service = self.state is None
        self.left_on_board = payload
        self.state = self.state or RobotState.DEFECT

    def note_trouble(self, reason: str) -> bool:
        """Leave service while the robot tells a reason, and come back when it is empty.

        Returns:
            Whether that changed anything.
        """
        if reason == self._trouble:
            return False
        if not reason:
            self.be_charged()
            return True
        self._trouble, self.is_on_its_own = reason, False
        self.state = RobotState.DEFECT
        if self.left_on_board is None:
            self.reason = reason
        return True

    def go_charging(self, reason: str) -> None:
        """Leave service to charge, on the robot's own initiative."""
        if self.state is not RobotState.DEFECT:
            self.state, self.reason, self.is_on_its_own = RobotState.CHARGING, reason, True

    def strand(self, reason: str) -> None:
        """Leave service for good because the battery is empty."""
        self.state, self.is_on_its_own = RobotState.DEFECT, False
        if self.left_on_board is None:
            self.reason = reason

    def be_charged(self) -> None:
        """Come back into service; only a person can say that a load left on board is gone."""
        if self.left_on_board is None:
            self.set("idle")
        else:
            self.state, self.is_on_its_own, self._trouble = RobotState.DEFECT, False, ""
