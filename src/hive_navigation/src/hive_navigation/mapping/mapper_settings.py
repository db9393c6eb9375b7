# SPDX-License-Identifier: BSD-3-Clause
"""The settings of the mapper, with the names that ROS's `gmapping` gives them."""

from __future__ import annotations

from dataclasses import dataclass

from hive_common.errors import ParameterError
from hive_common.map_file import MAX_CELLS
from hive_common.number_checks import check_numbers
from hive_common.pose import Pose

ABOVE_ZERO = {"delta", "maxUrange", "map_update_interval"}

AT_LEAST_ZERO = {"linearUpdate", "angularUpdate", "tf_delay"}


WITHOUT_EFFECT = frozenset({
    "astep", "base_frame", "iterations", "kernelSize", "lasamplerange", "lasamplestep",
    "llsamplerange", "llsamplestep", "lsigma", "lskip", "lstep", "map_frame", "maxRange",
    "minimumScore", "occ_thresh", "odom_frame", "ogain", "particles", "resampleThreshold",
    "sigma", "srr", "srt", "str", "stt", "temporalUpdate", "throttle_scans",
    "transform_publish_period",
})  # fmt: skip
"""Parameters of gmapping that a file may hold and that are ignored."""


@dataclass(frozen=True)
class MapperSettings:
    """The settings of a mapper; `config/mapper.yaml` explains each.

    Raises:
        ParameterError: A value is not allowed.
    """

    delta: float = 0.05  # [m]
    xmin: float = -5.0  # frame map [m]
    ymin: float = -5.0  # frame map [m]
    xmax: float = 5.0  # frame map [m]
    ymax: float = 5.0  # frame map [m]
    maxUrange: float = 80.0  # [m]  # noqa: N815  (gmapping's name)
    linearUpdate: float = 0.1  # [m]  # noqa: N815  (gmapping's name)
    angularUpdate: float = 0.1  # [rad]  # noqa: N815  (gmapping's name)
    map_update_interval: float = 2.0  # [s]
    tf_delay: float = 0.1  # [s]
    initial_pose_x: float = 0.0  # frame map [m]
    initial_pose_y: float = 0.0  # frame map [m]
    initial_pose_a: float = 0.0  # frame map [rad]

    def __post_init__(self) -> None:
        check_numbers(self, ABOVE_ZERO, AT_LEAST_ZERO)
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
        """Where the robot starts, frame map."""
        return Pose(self.initial_pose_x, self.initial_pose_y, self.initial_pose_a)
