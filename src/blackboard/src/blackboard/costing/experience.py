# SPDX-License-Identifier: BSD-3-Clause
"""How long a robot's steps take and what they draw from its battery, learned from those it did.

Besides its length, a drive's duration depends on the building as much as on the robot: bends,
narrow places, turning at both ends. No data sheet tells it, nor how worn a wheel is. So a robot
begins with a formula, and corrects it after every step (`costing.estimator`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from blackboard.domain.task import StepKind
from blackboard.errors import CharacteristicsError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from blackboard.domain.characteristics import RobotCharacteristics
    from hive_common.pose import Pose

    Floats = NDArray[np.float64]

_Number = TypeVar("_Number", float, "NDArray[np.float64]")

MEAN_SPEED_SHARE = 0.6
"""The formula: the mean speed over the demo's drives, as a share of the greatest speed
(docs/benchmarks.md)."""

LEAST, MOST = 0.3, 3.0
"""A share of what the formula gives is at least and at most so much."""

ENDS = 10.0
"""A drive takes at most `MOST` times the formula and this: that counts no turning [s]."""

_FORMULA_SHARES = (1.0, 1.0, 1.0, 1.0)


class Learned(NamedTuple):
    """What a robot has learned, in numbers; see `BidBasis.msg`.

    Attributes:
        per_drive: What a drive takes in any case [s].
        per_metre: What it takes for its length [s/m].
        per_radian: What it takes for turning at both ends [s/rad].
        friction: What a drive draws, as a share of what friction draws by the formula.
        power: What electronics and arm draw, as a share of what the formula says.
        pick, place: How long the arm works, as a share of what the formula says.
        time_margin: A task takes longer than predicted by more than this times the root of the
            predicted time once in ten times [√s].
        energy_margin: By which share more than predicted a task draws once in ten times.
        drives: How many drives it was learned from, perhaps those of other robots; 0 where it is
            the formula.
    """

    per_drive: float
    per_metre: float
    per_radian: float
    friction: float
    power: float
    pick: float
    place: float
    time_margin: float
    energy_margin: float
    drives: float


TIME_MARGIN, ENERGY_MARGIN = 3.0, 0.6
"""The margins of the formula: of twenty tasks it predicts about one even worse."""

_MOST_MARGINS = 10.0
"""A margin is at most so many times the formula's."""

_MOST_DRIVES = 1e6

TIMES = 3
"""How many numbers of `Learned` are times of drives; older robots tell these only."""


def by_formula(max_speed: float) -> Learned:
    """Return what a robot of a greatest speed [m/s] takes for granted before it has learned."""
    pace = 1.0 / max_speed / MEAN_SPEED_SHARE
    return Learned(0.0, pace, 0.0, *_FORMULA_SHARES, TIME_MARGIN, ENERGY_MARGIN, 0.0)


class Experience:
    """Predicts the durations and the energies of a robot's steps.

    Args:
        body: What the robot is.
        told: What has been learned already: a `Learned`, its first three numbers, or nothing.

    Attributes:
        learned: What has been learned, or the formula.

    Raises:
        CharacteristicsError: What was told has another length.
    """

    def __init__(self, body: RobotCharacteristics, told: Sequence[float] = ()) -> None:
        self._formula = by_formula(body.max_speed)
        self._arm = {kind: body.arm_time(kind) for kind in StepKind}
        self._fastest = 1.0 / body.max_speed
        if len(told) not in {0, TIMES, len(self._formula)}:
            raise CharacteristicsError(
                f"pace is {tuple(told)}; allowed: {TIMES} or {len(self._formula)} numbers, "
                "or nothing"
            )
        self.use(Learned(*told, *self._formula[len(told) :]))

    def use(self, learned: Learned) -> None:
        """Predict by some numbers from now on; all but times are kept within their limits."""
        shares = {
            name: min(max(getattr(learned, name), LEAST), MOST)
            for name in ("friction", "power", "pick", "place")
        }
        limits = {
            "time_margin": _MOST_MARGINS * TIME_MARGIN,
            "energy_margin": _MOST_MARGINS * ENERGY_MARGIN,
            "drives": _MOST_DRIVES,
        }
        others = {name: min(max(getattr(learned, name), 0.0), limits[name]) for name in limits}
        self.learned = learned._replace(**shares, **others)

    @property
    def is_formula(self) -> bool:
        """Whether nothing has been learned."""
        return self.learned.drives == 0

    def duration(self, start: Pose, goal: Pose, distance: float) -> float:
        """Return how long a drive over a distance [m] takes [s]; infinite if there is no path."""
        if distance == 0.0 or math.isinf(distance):
            return distance
        turning = turning_at_ends(start, goal) if self.learned.per_radian else 0.0
        most = MOST * self._formula.per_metre * distance + ENDS
        return min(max(self._fastest * distance, self._by_pace(distance, turning)), most)

    def durations(self, distances: Floats, turning: Floats) -> Floats:
        """Return how long many drives take [s]; see `duration` and `turnings`."""
        least = self._fastest * distances
        most = MOST * self._formula.per_metre * distances + ENDS
        taken = np.minimum(np.maximum(least, self._by_pace(distances, turning)), most)
        found: Floats = np.where((distances == 0.0) | np.isinf(distances), distances, taken)
        return found

    def _by_pace(self, distance: _Number, turning: _Number) -> _Number:
        per_drive, per_metre, per_radian, *_ = self.learned
        return per_drive + per_metre * distance + per_radian * turning

    def is_clipped(self, start: Pose, goal: Pose, distance: float) -> bool:
        """Return whether a drive's prediction is outside of what is allowed for it."""
        unlimited = self._by_pace(distance, turning_at_ends(start, goal))
        return self.duration(start, goal, distance) != unlimited

    def arm_time(self, kind: StepKind) -> float:
        """Return how long the arm works in a kind of step [s]."""
        share = self.learned.pick if kind is StepKind.PICK else self.learned.place
        return share * self._arm[kind]

    def most_time(self, duration: float) -> float:
        """Return what nine of ten tasks predicted to take a time take at most [s]."""
        return duration + self.learned.time_margin * math.sqrt(duration)

    def most_energy(self, energy: float) -> float:
        """Return what nine of ten tasks predicted to draw an energy draw at most [J]."""
        return energy * (1.0 + self.learned.energy_margin)


def turnings(starts: Sequence[Pose], goals: Sequence[Pose]) -> Floats:
    """Return how much a robot turns at both ends of straight paths [rad], (starts, goals)."""
    here = np.array([(pose.x, pose.y, pose.yaw) for pose in starts]).reshape(-1, 1, 3)
    there = np.array([(pose.x, pose.y, pose.yaw) for pose in goals]).reshape(1, -1, 3)
    offset = there - here
    bearing = np.arctan2(offset[..., 1], offset[..., 0])
    both = _bend(bearing - here[..., 2]) + _bend(there[..., 2] - bearing)
    stays = (offset[..., 0] == 0.0) & (offset[..., 1] == 0.0)
    found: Floats = np.where(stays, _bend(offset[..., 2]), both)
    return found


def _bend(angle: Floats) -> Floats:
    """Return angles without whole turns and without their signs [rad]."""
    bend: Floats = np.abs((angle + math.pi) % math.tau - math.pi)
    return bend


def turning_at_ends(start: Pose, goal: Pose) -> float:
    """Return how much a robot turns at both ends of a straight path [rad]."""
    if start.distance_to(goal) == 0.0:
        return abs(math.remainder(goal.yaw - start.yaw, math.tau))
    bearing = math.atan2(goal.y - start.y, goal.x - start.x)
    turn = abs(math.remainder(bearing - start.yaw, math.tau))
    return turn + abs(math.remainder(goal.yaw - bearing, math.tau))
