# SPDX-License-Identifier: BSD-3-Clause
"""What may be chosen for the particle filter, by the names that ROS's `amcl` has for it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from hive_common.errors import HiveError
from hive_common.pose import Pose

if TYPE_CHECKING:
    from numpy.typing import NDArray

SHARES = frozenset({"laser_z_hit", "laser_z_rand", "recovery_alpha_slow", "recovery_alpha_fast"})
"""Settings that are shares of a whole, 0..1."""

MAY_BE_ZERO = SHARES | {
    "update_min_d", "update_min_a", "transform_tolerance", "initial_cov_xx", "initial_cov_yy",
    "initial_cov_aa", "odom_alpha1", "odom_alpha2", "odom_alpha3", "odom_alpha4", "odom_alpha5",
}  # fmt: skip
"""Settings that may be 0; all others have to be above."""

ANY_NUMBER = frozenset({"initial_pose_x", "initial_pose_y", "initial_pose_a"})


class SettingError(HiveError):
    """A setting has a value that is not allowed; the text names it and what is."""


@dataclass(frozen=True)
class AmclSettings:
    """The settings of one robot's particle filter; `config/amcl.yaml` explains them to users.

    Attributes:
        min_particles, max_particles: Between these KLD sampling chooses how many there are.
        kld_err: How far the particles may be from the true distribution.
        kld_z: Quantile of the normal distribution for the probability that they are not farther.
        update_min_d: The robot moves so far before it looks at a scan again [m].
        update_min_a: Or turns so far [rad].
        update_rate: It looks at no more scans than that [Hz].
        resample_interval: Every how many of these scans the particles are drawn anew.
        transform_tolerance: How far ahead map -> odom is dated [s].
        recovery_alpha_slow, recovery_alpha_fast: How quickly the long and the short average of
            the scans' likelihood follow; 0 and 0 for no particles put down at random.
        initial_pose_x, initial_pose_y, initial_pose_a: Where it starts, frame map [m, m, rad].
        initial_cov_xx, initial_cov_yy, initial_cov_aa: How sure that is [m^2, m^2, rad^2].
        laser_max_beams: How many beams of a scan count.
        laser_z_hit: Share of beams that end where the map says.
        laser_z_rand: Share of beams that end anywhere: people, other robots.
        laser_sigma_hit: How far from what the map shows a good beam may end [m].
        laser_likelihood_max_dist: A beam that ends farther from anything is not worse [m].
        odom_model_type: `diff` or `omni`.
        odom_alpha1: Noise of turns by turning [-], as a variance.
        odom_alpha2: Noise of turns by going [rad^2/m^2].
        odom_alpha3: Noise of distances by going [-], as a variance.
        odom_alpha4: Noise of distances by turning [m^2/rad^2].
        odom_alpha5: Noise sideways by going [-], as a variance; `omni` only.
    """

    min_particles: int = 200
    max_particles: int = 20000
    kld_err: float = 0.02
    kld_z: float = 2.33
    update_min_d: float = 0.1
    update_min_a: float = 0.1
    update_rate: float = 5.0
    resample_interval: int = 1
    transform_tolerance: float = 0.2
    recovery_alpha_slow: float = 0.0
    recovery_alpha_fast: float = 0.0
    initial_pose_x: float = 0.0
    initial_pose_y: float = 0.0
    initial_pose_a: float = 0.0
    initial_cov_xx: float = 0.04
    initial_cov_yy: float = 0.04
    initial_cov_aa: float = 0.01
    laser_max_beams: int = 60
    laser_z_hit: float = 0.9
    laser_z_rand: float = 0.1
    laser_sigma_hit: float = 0.2
    laser_likelihood_max_dist: float = 1.0
    odom_model_type: str = "diff"
    odom_alpha1: float = 0.01
    odom_alpha2: float = 0.01
    odom_alpha3: float = 0.01
    odom_alpha4: float = 0.01
    odom_alpha5: float = 0.01

    def __post_init__(self) -> None:
        """Refuse what makes no filter."""
        for field in fields(self):
            if field.name != "odom_model_type":
                self._check(field.name, getattr(self, field.name))
        if self.odom_model_type not in {"diff", "omni"}:
            raise SettingError(f"odom_model_type: {self.odom_model_type!r}; allowed: diff, omni")
        if self.min_particles > self.max_particles:
            raise SettingError(
                f"min_particles: {self.min_particles} is above max_particles "
                f"{self.max_particles}; lower it"
            )

    @property
    def initial_pose(self) -> Pose:
        """Where the robot starts, frame map."""
        return Pose(self.initial_pose_x, self.initial_pose_y, self.initial_pose_a)

    @property
    def initial_covariance(self) -> NDArray[np.float64]:
        """How sure that is: (3, 3) of x, y, yaw [m^2, rad^2]."""
        return np.diag([self.initial_cov_xx, self.initial_cov_yy, self.initial_cov_aa])

    @staticmethod
    def _check(name: str, value: float) -> None:
        good = not isinstance(value, bool) and math.isfinite(value)
        if name in ANY_NUMBER:
            allowed = "a finite number"
        elif name in SHARES:
            good, allowed = good and 0 <= value <= 1, "a number from 0 to 1"
        elif name in MAY_BE_ZERO:
            good, allowed = good and value >= 0, "a number of at least 0"
        else:
            good, allowed = good and value > 0, "a number above 0"
        if not good:
            raise SettingError(f"{name}: {value}; allowed: {allowed}")
