# SPDX-License-Identifier: BSD-3-Clause
"""The port behind which the core asks how far robots drive; `costing.path_lengths` implements it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hive_common.pose import Pose


class PathLengths(Protocol):
    """Knows the length of the way between two poses, and where nobody can stand."""

    def length(self, start: Pose, goal: Pose) -> float:
        """Return the length of the way [m]; infinite where there is none."""

    def refusal(self, pose: Pose) -> str:
        """Say why nobody can stand at a pose, to follow its name; empty where one can."""
