# SPDX-License-Identifier: BSD-3-Clause
"""The settings of the particle filter, with the names that ROS's `amcl` gives them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.errors import ParameterError
from hive_common.number_checks import check_numbers
from hive_common.pose import Pose

if TYPE_CHECKING:
    from hive_common.geometry import Array

SHARES = {"laser_z_hit", "laser_z_rand", "recovery_alpha_slow", "recovery_alpha_fast"}

ABOVE_ZERO = {
    "min_particles", "max_particles", "kld_err", "kld_z", "update_rate", "resample_interval",
    "laser_max_beams", "laser_sigma_hit", "laser_likelihood_max_dist",
}  # fmt: skip

AT_LEAST_ZERO = {
    "update_min_d", "update_min_a", "transform_tolerance", "initial_cov_xx", "initial_cov_yy",
    "initial_cov_aa", "odom_alpha1", "odom_alpha2", "odom_alpha3", "odom_alpha4", "odom_alpha5",
}  # fmt: skip


WITHOUT_EFFECT = frozenset({
    "base_frame_id", "do_beamskip", "beam_skip_distance", "beam_skip_error_threshold",
    "beam_skip_threshold", "first_map_only", "global_frame_id", "gui_publish_rate",
    "laser_lambda_short", "laser_max_range", "laser_min_range", "laser_model_type",
    "laser_z_max", "laser_z_short", "odom_frame_id", "save_pose_rate", "selective_resampling",
    "tf_broadcast", "use_map_topic", "bond_enabled",
})  # fmt: skip
"""Parameters of ROS's amcl that a file may hold and that are ignored."""


@dataclass(frozen=True)
class AmclSettings:
    """The settings of one robot's particle filter; `config/amcl.yaml` explains each.

    Raises:
        ParameterError: A value is not allowed.
    """

    min_particles: int = 200
    max_particles: int = 20000
    kld_err: float = 0.02
    kld_z: float = 2.33
    update_min_d: float = 0.1  # [m]
    update_min_a: float = 0.1  # [rad]
    update_rate: float = 5.0  # [Hz]
    resample_interval: int = 1  # in scans
    transform_tolerance: float = 0.2  # [s]
    recovery_alpha_slow: float = 0.0
    recovery_alpha_fast: float = 0.0
    initial_pose_x: float = 0.0  # frame map [m]
    initial_pose_y: float = 0.0  # frame map [m]
    initial_pose_a: float = 0.0  # frame map [rad]
    initial_cov_xx: float = 0.04  # [m^2]
    initial_cov_yy: float = 0.04  # [m^2]
    initial_cov_aa: float = 0.01  # [rad^2]
    laser_max_beams: int = 60
    laser_z_hit: float = 0.9
    laser_z_rand: float = 0.1
    laser_sigma_hit: float = 0.2  # [m]
    laser_likelihood_max_dist: float = 1.0  # [m]
    odom_model_type: str = "diff"
    odom_alpha1: float = 0.01  # [-]
    odom_alpha2: float = 0.01  # [rad^2/m^2]
    odom_alpha3: float = 0.01  # [-]
    odom_alpha4: float = 0.01  # [m^2/rad^2]
    odom_alpha5: float = 0.01  # [-]

    def __post_init__(self) -> None:
        check_numbers(self, ABOVE_ZERO, AT_LEAST_ZERO, SHARES)
        if self.odom_model_type.removesuffix("-corrected") not in {"diff", "omni"}:
            raise ParameterError(f"odom_model_type: {self.odom_model_type!r}; allowed: diff, omni")
        if self.min_particles > self.max_particles:
            raise ParameterError(
                f"min_particles: {self.min_particles} is above max_particles "
                f"{self.max_particles}; lower it"
            )

    @property
    def initial_pose(self) -> Pose:
        """Where the robot starts, frame map."""
        return Pose(self.initial_pose_x, self.initial_pose_y, self.initial_pose_a)

    @property
    def odom_alphas(self) -> tuple[float, ...]:
        """`odom_alpha1` to `odom_alpha5`."""
        return tuple(getattr(self, f"odom_alpha{number}") for number in range(1, 6))

    @property
    def initial_covariance(self) -> Array:
        """Covariance of that pose, (3, 3) of x, y, yaw [m^2, rad^2]."""
        return np.diag([self.initial_cov_xx, self.initial_cov_yy, self.initial_cov_aa])
