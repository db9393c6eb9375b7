# SPDX-License-Identifier: BSD-3-Clause
"""The port that tells how far robots drive; two modules of `costing` implement it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from hive_common.pose import Pose

    Floats = NDArray[np.float64]
    Field = tuple[Floats, Floats | None]


class Moves(NamedTuple):
    """Where robots can drive: moves between nodes, sorted by the node where they end.

    Attributes:
        first: (nodes + 1,) the number of the first move to each node.
        starts: The node where each begins.
        costs: The way that counts as much as each, time lost in traffic included [m].
        lengths: [m]; the same array as `costs` where no traffic costs time.
    """

    first: NDArray[np.int32]
    starts: NDArray[np.int32]
    costs: Floats
    lengths: Floats


class FieldJob(NamedTuple):
    """Distance fields that are wanted: the paths from every node to each of some `goals`.

    The answer has for each goal (nodes,) lengths, infinite where there is no path, and how much
    farther each counts, or None without traffic [m].
    """

    moves: Moves
    goals: list[int]


class Wanted(NamedTuple):
    """Fields that another process may compute; `keep` takes in its answer."""

    job: FieldJob
    keep: Callable[[Sequence[Field]], None]


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

    def wanted(self, ways: Sequence[Sequence[Pose]]) -> Wanted | None:
        """Return what takes long to compute of the paths to some ways and along them.

        It is None if that is nothing. Each way has the poses that a robot passes in this order.
        What is asked for next should be about them, because only so much is kept.
        """

    def refusal(self, pose: Pose) -> str:
        """Return why no robot can stand at a pose, to follow its name; empty if one can."""
