# SPDX-License-Identifier: BSD-3-Clause
"""A robot's localization: which scans are used, and the transform map -> odom.

Between two scans the odometry is trusted: map -> odom stays as it is until the next scan has been
weighed, and the robot's pose is that transform and the latest odometry.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from hive_common.pose import between, compose, inverse

if TYPE_CHECKING:
    from hive_common.geometry import Array
    from hive_common.pose import Pose
    from hive_navigation.localization.amcl_settings import AmclSettings
    from hive_navigation.localization.likelihood_field import BeamChooser, LikelihoodField
    from hive_navigation.localization.particle_filter import Estimate, ParticleFilter
    from robot_description.scan import Scan

EARLY = 0.01  # how much earlier than due a scan may come [s]


class Localizer:
    """The localization of one robot."""

    def __init__(
        self, particles: ParticleFilter, chooser: BeamChooser, settings: AmclSettings
    ) -> None:
        """Use a particle filter that has been started."""
        self.estimate: Estimate | None = None  # at the last scan used; None before the first
        self.map_to_odom: Pose | None = None  # origin of odometry, frame map; None until a scan
        self._filter = particles
        self._chooser = chooser
        self._settings = settings
        self._odometry: Pose | None = None
        self._used_at = -math.inf
        self._due = True
        self._count = 0

    def restart_at(self, pose: Pose, covariance: Array) -> None:
        """Start again around a pose, frame map; `covariance` (3, 3) [m^2, rad^2]."""
        self._filter.start_at(pose, covariance)
        self._due = True

    def restart_anywhere(self) -> None:
        """Start again without knowing where the robot is."""
        self._filter.start_anywhere()
        self._due = True

    def change_map(self, field: LikelihoodField) -> None:
        """Go on from where the robot is taken to be, on another map; see `ParticleFilter`."""
        self._filter.change_map(field)
        self._due = True

    def update_once(self) -> None:
        """Use the next scan even if the robot does not move."""
        self._due = True

    def pose(self, odometry: Pose) -> Pose:
        """Return where the robot is, frame map, by its odometry, once a scan has been used."""
        if self.map_to_odom is None:
            raise ValueError("no scan has been used yet; pass one to see()")
        return compose(self.map_to_odom, odometry)

    def see(self, time: float, odometry: Pose, scan: Scan) -> bool:
        """Take in a scan with its time [s] and the base's odometry then, frame odom.

        Return whether it was used; then `estimate` and `map_to_odom` are new.
        """
        if self._odometry is None:
            self._odometry = odometry
        if time < self._used_at:  # A simulation has restarted.
            self._used_at = -math.inf
        move = between(self._odometry, odometry)
        if not self._due and not self._worth(time, move):
            return False
        self._odometry, self._used_at, self._due = odometry, time, False
        self._filter.move(move)
        self._filter.weigh(self._chooser.of(scan))
        self.estimate = self._filter.estimate()
        self.map_to_odom = compose(self.estimate.pose, inverse(odometry))
        self._count += 1
        if self._count % self._settings.resample_interval == 0 and self._filter.depleted:
            self._filter.resample()
        return True

    def _worth(self, time: float, move: Pose) -> bool:
        """Return whether a scan after a move is worth weighing."""
        if time - self._used_at < 1.0 / self._settings.update_rate - EARLY:
            return False
        far = math.hypot(move.x, move.y) >= self._settings.update_min_d
        return far or abs(move.yaw) >= self._settings.update_min_a
