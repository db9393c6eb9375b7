# SPDX-License-Identifier: BSD-3-Clause
"""What may be chosen for the mapper, by the names that ROS's `gmapping` has for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from hive_common.errors import ParameterError
from hive_common.map_file import MAX_CELLS
from hive_common.pose import Pose

ABOVE_ZERO = frozenset({"delta", "maxUrange", "map_update_interval"})
"""Settings that have to be above 0."""

AT_LEAST_ZERO = frozenset({"linearUpdate", "angularUpdate", "tf_delay"})
"""Settings that may be 0; all others may be any number."""

WITHOUT_EFFECT = frozenset({
    "astep", "base_frame", "iterations", "kernelSize", "lasamplerange", "lasamplestep",
    "llsamplerange", "llsamplestep", "lsigma", "lskip", "lstep", "map_frame", "maxRange",
    "minimumScore", "occ_thresh", "odom_frame", "ogain", "particles", "resampleThreshold",
    "sigma", "srr", "srt", "str", "stt", "temporalUpdate", "throttle_scans",
    "transform_publish_period",
})  # fmt: skip
"""Parameters of gmapping that a file may hold, and that change nothing here."""


@dataclass(frozen=True)
class MapperSettings:
    """The settings of a mapper; `config/mapper.yaml` explains them to users.

    Attributes:
        delta: Side of a cell [m].
        xmin, ymin, xmax, ymax: Corners of the map at the start, frame map [m]; it grows.
        maxUrange: What is farther away is not drawn [m].
        linearUpdate: A scan is taken in once the robot has moved so far since the last one [m] ...
        angularUpdate: ... or has turned so far [rad].
        map_update_interval: Between two maps [s].
        tf_delay: How far ahead map -> odom is dated [s].
        initial_pose_x, initial_pose_y, initial_pose_a: Where the robot stands at the start, which
            fixes the frame map [m, m, rad].
    """

    delta: float = 0.05
    xmin: float = -5.0
    ymin: float = -5.0
    xmax: float = 5.0
    ymax: float = 5.0
    maxUrange: float = 80.0  # noqa: N815  (gmapping's name)
    linearUpdate: float = 0.1  # noqa: N815  (gmapping's name)
    angularUpdate: float = 0.1  # noqa: N815  (gmapping's name)
    map_update_interval: float = 2.0
    tf_delay: float = 0.1
    initial_pose_x: float = 0.0
    initial_pose_y: float = 0.0
    initial_pose_a: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what makes no map.

        Raises:
            ParameterError: A setting has a value that is not allowed.
        """
        for field in fields(self):
            value = getattr(self, field.name)
            good, allowed = math.isfinite(value), "a finite number"
            if field.name in ABOVE_ZERO:
                good, allowed = good and value > 0, "a number above 0"
            elif field.name in AT_LEAST_ZERO:
                good, allowed = good and value >= 0, "a number of at least 0"
            if not good:
                raise ParameterError(f"{field.name}: {value}; allowed: {allowed}")
        for low, high in (("xmin", "xmax"), ("ymin", "ymax")):
            if getattr(self, high) - getattr(self, low) < self.delta:
                raise ParameterError(
                    f"{high}: {getattr(self, high)} is not above {low} {getattr(self, low)} by a "
                    f"cell of {self.delta} m"
                )
        width, depth = self.size
        if width * depth / self.delta**2 > MAX_CELLS:
            raise ParameterError(
                f"delta: {self.delta} m is too fine for {width:g} m x {depth:g} m; "
                f"allowed: at most {MAX_CELLS:,} cells"
            )

    @property
    def size(self) -> tuple[float, float]:
        """Width and depth of the map at the start [m]."""
        return self.xmax - self.xmin, self.ymax - self.ymin

    @property
    def initial_pose(self) -> Pose:
        """Where the robot stands at the start, frame map."""
        return Pose(self.initial_pose_x, self.initial_pose_y, self.initial_pose_a)
