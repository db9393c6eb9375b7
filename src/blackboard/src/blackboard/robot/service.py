# SPDX-License-Identifier: BSD-3-Clause
"""Whether a robot is in service, and which load was left on board."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain.characteristics import RobotState

if TYPE_CHECKING:
    from hive_common.pose import Pose

FORGET = "forget"

WORDS = ("idle", "defect", "charging", "charge", FORGET)
"""What an operator can tell a robot: to be in service, out of service, or charging where it
stands, to go to a charger, or to forget what it has learned of its steps."""

PUT_DOWN = "put_down"
"""Before `x y yaw` [m, m, rad, map frame], tells it to put a load down there that was left."""


def put_down_word(place: Pose) -> str:
    """Return the word that sends a robot to put its load down at a place [map frame]."""
    return f"{PUT_DOWN} {place.x:.3f} {place.y:.3f} {place.yaw:.4f}"


class Service:
    """Whether a robot is out of service, with the reason in words.

    Three things take it out of service, each for itself: a trouble, a load that was left on board,
    and charging or an operator's word. When one of them ends, the others still count.

    Attributes:
        left_on_board: The load that was left on board [kg]; None if none was.
        about_load: What there is to say about that load; empty if none was left.
        is_sure: Whether that load is known, and not only to the arm.
        is_on_its_own: Whether it left service by itself to charge, not because of a person.
    """

    def __init__(self) -> None:
        self.left_on_board: float | None = None
        self.about_load = ""
        self.is_sure = False
        self.is_on_its_own = False
        self._told = ""  # the trouble that the robot itself tells
        self._stranded = ""
        self._word: RobotState | None = None
        self._about_word = ""

    @property
    def trouble(self) -> str:
        """Why it can do nothing at all; empty if it can."""
        return self._told or self._stranded

    @property
    def state(self) -> RobotState | None:
        """DEFECT or CHARGING while out of service, otherwise None."""
        is_kept_out = self.left_on_board is not None and self._word is None
        return RobotState.DEFECT if self.trouble or is_kept_out else self._word

    @property
    def reason(self) -> str:
        """Why it is out of service; empty otherwise."""
        return "; ".join(filter(None, (self.trouble, self.about_load))) or self._about_word

    def set(self, word: str) -> None:
        """Be set `idle`, `defect` or `charging`; `idle` says too that nothing is on board."""
        self._stranded, self.is_on_its_own = "", False
        if word == "idle":
            self._word, self._about_word = None, ""
            self.unload()
        else:
            self._word, self._about_word = RobotState[word.upper()], f"{word}, set by an operator"

    def leave_on_board(self, task_id: str, payload: float) -> None:
        """Leave service because of a load [kg] that is on board and no longer wanted."""
        self.left_on_board, self.is_sure = payload, True
        self.about_load = (
            f"the load of {task_id} ({payload:g} kg) is on board: send the robot to put it down, "
            "or take it off, then set the robot idle"
        )

    def leave_unknown_on_board(self, what: str) -> None:
        """Leave service because of a load on board of which only the arm knows, in words."""
        self.left_on_board, self.is_sure = self.left_on_board or 0.0, False
        self.about_load = f"{what}: take it off, then set the robot idle"

    def unload(self) -> None:
        """Have no load left on board any more."""
        self.left_on_board, self.about_load = None, ""

    def note_trouble(self, reason: str) -> bool:
        """Leave service while the robot tells a reason, and come back when it is empty.

        Returns:
            Whether that changed anything.
        """
        is_new = reason != self._told
        self._told = reason
        return is_new

    def strand(self, reason: str) -> None:
        """Leave service until an operator's word because the battery is empty."""
        self._stranded = reason

    def go_charging(self, reason: str) -> None:
        """Leave service to charge, on the robot's own initiative."""
        if self.state is not RobotState.DEFECT:
            self._word, self._about_word, self.is_on_its_own = RobotState.CHARGING, reason, True

    def be_charged(self) -> None:
        """Have charged enough; a load that was left on board still keeps it out of service."""
        self._word, self._about_word, self.is_on_its_own = None, "", False
