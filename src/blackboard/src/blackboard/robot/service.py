# SPDX-License-Identifier: BSD-3-Clause
"""Whether a robot is in service, and which load was left on board."""

from __future__ import annotations

from blackboard.domain.characteristics import RobotState

WORDS = ("idle", "defect", "charging", "charge")
"""What an operator can tell a robot: to be in service, out of service, or charging where it
stands, or to go to a charger."""


class Service:
    """Whether a robot is out of service, with the reason in words.

    A robot with a load that nobody wants leaves service until a person has seen to it.

    Attributes:
        state: DEFECT or CHARGING while out of service, otherwise None.
        reason: Why it is out of service; empty otherwise.
        left_on_board: The load that was left on board [kg]; None if none was.
        is_on_its_own: Whether it left service by itself to charge, not because of a person.
    """

    def __init__(self) -> None:
        self.state: RobotState | None = None
        self.reason = ""
        self.left_on_board: float | None = None
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

    def leave_on_board(self, task_id: str, payload: float) -> None:
        """Leave service because of a load [kg] that is on board and no longer wanted."""
        self.left_on_board = payload
        self.state = self.state or RobotState.DEFECT
        self.reason = (
            f"the load of {task_id} ({payload:g} kg) is on board: "
            "take it off, then set the robot idle"
        )

    def leave_unknown_on_board(self, what: str) -> None:
        """Leave service because of a load on board of which only the arm knows, in words."""
        self.left_on_board = self.left_on_board or 0.0
        self.state = self.state or RobotState.DEFECT
        self.reason = f"{what}: take it off, then set the robot idle"

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
        self.set("idle" if self.left_on_board is None else "defect")
