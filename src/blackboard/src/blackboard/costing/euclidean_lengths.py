# SPDX-License-Identifier: BSD-3-Clause
"""The lengths of paths as the crow flies; members that need no map load no scipy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from hive_common.pose import Pose


_COLUMN_TIME, _LENGTH_TIME = 2e-5, 5e-7
"""Processor time that the lengths to one goal take, and each of them [s]."""


class EuclideanLengths:
    """Straight-line distances, as in the report; knows of no wall."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the distance [m]."""
        return start.distance_to(goal)

    def length_and_delay(self, start: Pose, goal: Pose) -> tuple[float, float]:
        """Return the distance [m], and no delay."""
        return start.distance_to(goal), 0.0

    def lengths(self, starts: Sequence[Pose], goals: Sequence[Pose]) -> NDArray[np.float64]:
        """Return all distances, (starts, goals) [m]."""
        here = np.array([(pose.x, pose.y) for pose in starts]).reshape(-1, 1, 2)
        there = np.array([(pose.x, pose.y) for pose in goals]).reshape(1, -1, 2)
        lengths: NDArray[np.float64] = np.hypot(*np.moveaxis(there - here, -1, 0))
        return lengths

    def columns(
        self, starts: Sequence[Pose], goals: Sequence[Pose]
    ) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64], float]]:
        """Yield the distances from all starts [m] for each goal, no delays, and the time [s]."""
        taken = _COLUMN_TIME + _LENGTH_TIME * len(starts)
        for goal in goals:
            column = self.lengths(starts, [goal])[:, 0]
            yield column, np.zeros_like(column), taken

    def wanted(self, ways: Sequence[Sequence[Pose]]) -> None:
        """Return None: nothing takes long."""

    def refusal(self, pose: Pose) -> str:  # noqa: ARG002  (the port's argument)
        """Return an empty text: without a map, a robot can stand anywhere."""
        return ""
