# SPDX-License-Identifier: BSD-3-Clause
"""Filling goals by pointing at the map: which goal a click or a drag is meant for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fleet_manager.desk.words import text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fleet_manager.desk.facts import Clicked
    from hive_common.pose import Pose

SAME_PLACE = 0.5  # [m], how near a drag must start to the last click to mean the same goal


@dataclass(frozen=True, slots=True)
class Filled:
    """What a click does to the form.

    Attributes:
        name: The goal that is meant.
        x: [m], or None where it stays as it is.
        y: [m], or None where it stays as it is.
        yaw: [rad], or None where it stays as it is.
    """

    name: str
    x: float | None = None
    y: float | None = None
    yaw: float | None = None


class Picking:
    """Which goal the next click fills.

    A goal is armed by a person; a click fills it and arms the next one that the type needs. A drag
    that starts where the last click was sets the heading of that goal; any other drag fills the
    armed goal with its heading.

    Attributes:
        armed: Name of the goal that the next click fills; empty when clicks are none of ours.
        message: What to tell the person now; empty when there is nothing to say.
    """

    def __init__(self, frame: str = "map") -> None:
        self.armed = ""
        self.message = ""
        self._frame = frame
        self._last: tuple[str, Pose] | None = None

    def arm(self, name: str) -> None:
        """Let the next click fill this goal."""
        self.armed = name
        self._last = None
        self.message = text("pick.armed", name=name)

    def disarm(self) -> None:
        """Leave clicks alone."""
        self.armed = ""
        self._last = None
        self.message = ""

    def take(self, clicked: Clicked, needed: Sequence[str]) -> Filled | None:
        """Return what a click fills, or None when it is not meant for the form.

        Args:
            clicked: Where the person pointed.
            needed: Names of the goals that the chosen type needs, in order.
        """
        turns = clicked.has_heading and self._last and _near(self._last[1], clicked.pose)
        if not (self.armed or turns):
            return None
        if clicked.frame.lstrip("/") != self._frame:
            self.message = text("pick.frame", frame=clicked.frame[:64], wanted=self._frame)
            return None
        if not clicked.pose.is_finite:
            return None
        if turns and self._last:
            self.message = text("pick.heading", filled=self._last[0])
            return Filled(self._last[0], yaw=clicked.pose.yaw)
        return self._fill(clicked, needed)

    def _fill(self, clicked: Clicked, needed: Sequence[str]) -> Filled:
        filled, pose = self.armed, clicked.pose
        behind = needed[needed.index(filled) + 1 :] if filled in needed else ()
        self.armed = behind[0] if behind else ""
        self._last = (filled, pose)
        words = "pick.next" if self.armed else "pick.done"
        self.message = text(words, filled=filled, name=self.armed)
        return Filled(filled, pose.x, pose.y, pose.yaw if clicked.has_heading else None)


def _near(one: Pose, other: Pose) -> bool:
    return one.distance_to(other) <= SAME_PLACE
