# SPDX-License-Identifier: BSD-3-Clause
"""The port that tells how far robots drive; two modules of `costing` implement it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hive_common.pose import Pose


class PathLengths(Protocol):
    """Knows the length of the path between two poses, and where no robot can stand."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the path [m]; infinite if there is none."""

    def length_and_delay(self, start: Pose, goal: Pose) -> tuple[float, float]:
        """Return the length of the path [m] and the time that traffic costs on it [s].

        The length is infinite if there is no path.
        """

    def refusal(self, pose: Pose) -> str:
        """Return why no robot can stand at a pose, to follow its name; empty if one can."""
