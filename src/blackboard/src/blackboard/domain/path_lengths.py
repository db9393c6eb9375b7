# SPDX-License-Identifier: BSD-3-Clause
"""The port that tells how far robots drive; two modules of `costing` implement it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from hive_common.pose import Pose

    Floats = NDArray[np.float64]


class PathLengths(Protocol):
    """Knows the length of the path between two poses, and where no robot can stand."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the path [m]; infinite if there is none."""

    def length_and_delay(self, start: Pose, goal: Pose) -> tuple[float, float]:
        """Return the length of the path [m] and the time that traffic costs on it [s].

        The length is infinite if there is no path.
        """

    def columns(
        self, starts: Sequence[Pose], goals: Sequence[Pose]
    ) -> Iterator[tuple[Floats, Floats, float]]:
        """Yield, for each goal, lengths [m] and delays [s] of the paths from all starts.

        This is `length_and_delay` of many. The third is the processor time that the goal took [s],
        as it is counted and not measured: up to tens of milliseconds.
        """

    def refusal(self, pose: Pose) -> str:
        """Return why no robot can stand at a pose, to follow its name; empty if one can."""
