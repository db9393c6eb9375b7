# SPDX-License-Identifier: BSD-3-Clause
"""What a laser has measured, checked once for localization, mapping and the look for obstacles.

Lasers differ in where they begin, which way they turn, how many beams a turn has, and how far they
see. Their messages say so, and a robot model only says what to expect: so the message counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hive_common.geometry import Array
    from robot_description.models import Laser

MAX_BEAMS = 100_000

OVERLAP = 0.01
"""How far the last beam of a whole turn may lie behind the first [rad]. Some lasers measure one
direction twice, and their angles are rounded."""


class ScanError(ValueError):
    """A scan that cannot be used.

    Attributes:
        field: Which field of sensor_msgs/LaserScan is wrong.
    """

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(f"{field}: {value}; allowed: {allowed}")
        self.field = field


@dataclass(frozen=True)
class Scan:
    """The distances of one turn of a laser; the beams lie in the laser's frame."""

    angle_min: float  # direction of the first beam [rad]
    angle_increment: float  # from each beam to the next [rad]; below 0 if they go clockwise
    ranges: Array  # (n,) [m]; infinite if nothing was in range, NaN if unknown
    range_max: float  # how far the laser sees [m]

    @property
    def angles(self) -> Array:
        """The directions (n,) of the beams [rad]."""
        angles: Array = self.angle_min + self.angle_increment * np.arange(len(self.ranges))
        return angles

    def within(self, range_max: float) -> Scan:
        """Return what a laser that sees no farther than `range_max` [m] would have measured."""
        if range_max >= self.range_max:
            return self
        near = np.where(self.ranges >= range_max, np.inf, self.ranges)
        return Scan(self.angle_min, self.angle_increment, near, range_max)

    @classmethod
    def of(cls, laser: Laser, ranges: Array) -> Scan:
        """Return the scan of a robot model's laser, whose beams begin at minus half its view.

        Args:
            laser: Of the model.
            ranges: (n,) [m], as in a message.

        Raises:
            ScanError: No beam has measured anything.
        """
        increment = laser.field_of_view / max(1, len(ranges))
        limits = (laser.range_min, laser.range_max)
        return cls._checked(-laser.field_of_view / 2, increment, ranges, *limits)

    @classmethod
    def from_msg(cls, msg: Any) -> Scan:  # noqa: ANN401  (LaserScan)
        """Read a sensor_msgs/LaserScan; its `ranges` may be an array.

        Ranges of infinity or from `range_max` on are of beams with nothing in range. NaN and what
        is below `range_min` are unknown, and so is 0.

        Raises:
            ScanError: The message contradicts itself, or no beam has measured anything.
        """
        limits = (msg.range_min, msg.range_max)
        return cls._checked(msg.angle_min, msg.angle_increment, msg.ranges, *limits)

    @classmethod
    def _checked(
        cls,
        angle_min: float,
        increment: float,
        measured: Sequence[float] | Array,
        range_min: float,
        range_max: float,
    ) -> Scan:
        beams = len(measured)
        _expect("angle_min", angle_min, "a finite number", math.isfinite)
        _expect(
            "angle_increment",
            increment,
            "a finite number other than 0",
            lambda value: math.isfinite(value) and value != 0,
        )
        _expect("range_min", range_min, "a finite number", math.isfinite)
        _expect(
            "range_max",
            range_max,
            f"a finite number above 0 and above range_min {range_min:g}",
            lambda value: math.isfinite(value) and value > max(0.0, range_min),
        )
        _expect(
            "ranges",
            beams,
            f"1 to {MAX_BEAMS} beams, at most a whole turn of {abs(increment):g} rad each",
            lambda count: (
                1 <= count <= MAX_BEAMS and (count - 1) * abs(increment) <= math.tau + OVERLAP
            ),
        )
        ranges = np.array(measured, dtype=np.float64)
        known = (ranges > 0) & (ranges >= range_min)
        if not known.any():
            raise ScanError(
                "ranges",
                f"none of {beams} is known",
                f"distances from range_min {range_min:g} m on, or infinity where nothing is "
                "in range; uncover or replace the laser",
            )
        ranges[ranges >= range_max] = np.inf
        ranges[~known] = np.nan
        return cls(float(angle_min), float(increment), ranges, float(range_max))


def _expect(field: str, value: float, allowed: str, is_good: Callable[[float], bool]) -> None:
    if not is_good(value):
        raise ScanError(field, value, allowed)
