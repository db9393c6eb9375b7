# SPDX-License-Identifier: BSD-3-Clause
"""Filling goals by clicks on the map: which goal a click or a drag is meant for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.desk.facts import Clicked
    from hive_common.pose import Pose

SAME_PLACE = 0.5  # [m], a drag that starts this near the last click turns that goal
_CLICK = "click on the map (in RViz with Publish Point)"
_DRAG = "drag (in RViz with 2D Nav Goal)"


@dataclass(frozen=True, slots=True)
class Filled:
    """The fields of a goal that a click fills [m, m, rad]; None leaves a field as it is."""

    name: str
    x: float | None = None
    y: float | None = None
    yaw: float | None = None


class Picking:
    """Which goal the next click fills.

    A person arms a goal; a click fills it and arms the next one that the task's type needs. A drag
    that starts at the last click sets the heading of that goal; any other drag fills the armed
    goal with its heading.
    """

    def __init__(self, frame: str = "map") -> None:
        self.armed = ""  # the goal that the next click fills; empty while clicks are ignored
        self.message = ""  # what to tell the person now; may be empty
        self._frame = frame
        self._last: tuple[str, Pose] | None = None

    def arm(self, name: str) -> None:
        """Let the next click fill a goal."""
        self.armed = name
        self._last = None
        self.message = f"Goal {name}: {_CLICK}, or {_DRAG} to set its heading too."

    def disarm(self) -> None:
        """Ignore clicks from now on."""
        self.armed = ""
        self._last = None
        self.message = ""

    def wants_drag(self, start: Pose) -> bool:
        """Return whether a drag that starts at a point [map frame] is meant for a goal."""
        return bool(self.armed) or self._turns(start)

    def take(self, clicked: Clicked, needed: Sequence[str]) -> Filled | None:
        """Return what a click fills, or None where it is not meant for the form.

        `needed` are the names of the goals that the chosen type needs, in order.
        """
        turns = clicked.has_heading and self._turns(clicked.pose)
        if not (self.armed or turns):
            return None
        if clicked.frame.lstrip("/") != self._frame:
            self.message = (
                f"The click came in frame {clicked.frame[:64]}; set the Fixed Frame of RViz to "
                f"{self._frame} and click again."
            )
            return None
        if not clicked.pose.is_finite:
            return None
        if turns and self._last:
            self.message = f"The heading of goal {self._last[0]} is set."
            return Filled(self._last[0], yaw=clicked.pose.yaw)
        return self._fill(clicked, needed)

    def _turns(self, start: Pose) -> bool:
        """Return whether a drag from a point turns the goal that was filled last."""
        return self._last is not None and self._last[1].distance_to(start) <= SAME_PLACE

    def _fill(self, clicked: Clicked, needed: Sequence[str]) -> Filled:
        filled, pose = self.armed, clicked.pose
        behind = needed[needed.index(filled) + 1 :] if filled in needed else ()
        self.armed = behind[0] if behind else ""
        self._last = (filled, pose)
        then = f"To set its heading, {_DRAG} from there."
        if self.armed:
            then = f"Goal {self.armed}: {_CLICK}."
        self.message = f"Goal {filled} is filled. {then}"
        return Filled(filled, pose.x, pose.y, pose.yaw if clicked.has_heading else None)
