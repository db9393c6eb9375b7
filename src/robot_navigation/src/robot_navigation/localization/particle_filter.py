# SPDX-License-Identifier: BSD-3-Clause
"""Adaptive Monte Carlo localization: a cloud of particles estimates where a robot is.

KLD sampling (Fox, "Adapting the sample size in particle filters through KLD-sampling", 2003)
draws particles until the cloud is, with a given probability, within a given distance of the true
distribution: thousands for a robot that is lost, a few hundred for one that knows where it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose
from robot_navigation.localization.odometry_model import spread, wrap_yaws

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from robot_navigation.localization.amcl_settings import AmclSettings
    from robot_navigation.localization.likelihood_field import Beams, LikelihoodField

BIN = np.array([0.5, 0.5, math.radians(10.0)])
"""Size of the bins in which particles are counted [m, m, rad]; those of ROS's amcl."""

NEAR, NEAR_YAW = 0.8, math.radians(40.0)
"""Particles this near to the heaviest place belong to it [m], [rad]."""

START_ANYWHERE = 3  # a robot that is lost starts with this many times `max_particles`


@dataclass(frozen=True)
class Estimate:
    """Where the robot most likely is."""

    pose: Pose  # frame map
    covariance: Array  # (3, 3) of x, y, yaw [m^2, m rad, rad^2]
    share: float  # share of the weight that is there, 0..1; near 1 once the filter has converged


class ParticleFilter:
    """The cloud of one robot; the same random generator gives the same run."""

    def __init__(
        self, field: LikelihoodField, settings: AmclSettings, random: np.random.Generator
    ) -> None:
        self._field = field
        self._settings = settings
        self._random = random
        self._slow = self._fast = 0.0
        self.particles: Array = np.zeros((0, 3))  # (n, 3) poses, frame map [m, m, rad]
        self.weights: Array = np.zeros(0)  # (n,); their sum is 1

    def start_at(self, pose: Pose, covariance: Array) -> None:
        """Start around a pose, frame map; `covariance` (3, 3) of x, y, yaw [m^2, rad^2]."""
        count = self._settings.max_particles
        drawn = self._random.multivariate_normal(pose, covariance, size=count, method="eigh")
        self._take(drawn)

    def start_anywhere(self) -> None:
        """Start anywhere in the free space; the first scans thin the cloud to `max_particles`."""
        count = START_ANYWHERE * self._settings.max_particles
        self._take(self._field.anywhere(count, self._random))

    def _take(self, particles: Array) -> None:
        wrap_yaws(particles)
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))
        self._slow = self._fast = 0.0

    def move(self, move: Pose) -> None:
        """Move the cloud by odometry; `move` is seen from where the robot was."""
        self.particles = spread(self.particles, move, self._settings, self._random)

    def weigh(self, beams: Beams) -> None:
        """Weigh the particles by a scan."""
        likelihood = self._field.log_likelihood(self.particles, beams)
        highest = likelihood.max()
        weights = self.weights * np.exp(likelihood - highest)
        total = weights.sum()
        self._average(math.exp(highest) * total)
        self.weights = weights / total

    def _average(self, likelihood: float) -> None:
        """Update the long and the short average of the scans' likelihood."""
        slow, fast = self._settings.recovery_alpha_slow, self._settings.recovery_alpha_fast
        if self._slow == 0.0:
            self._slow = self._fast = likelihood
        self._slow += slow * (likelihood - self._slow)
        self._fast += fast * (likelihood - self._fast)

    @property
    def depleted(self) -> bool:
        """Whether few particles carry most of the weight, so that resampling is due.

        Resampling loses particles by chance. Until it is due, places that are only a little less
        likely stay in the cloud (Doucet's effective sample size, below half).
        """
        return bool(1.0 / np.square(self.weights).sum() < len(self.weights) / 2)

    def resample(self) -> None:
        """Draw new particles, as many as the uncertainty needs.

        If the latest scans are much less likely than those before, some of them are drawn
        anywhere, so that a robot that was carried away can find itself ("augmented" localization).
        """
        limit = self._settings.max_particles
        bounds = np.cumsum(self.weights)
        drawn = np.searchsorted(bounds, self._random.random(limit) * bounds[-1])
        found = self.particles[np.minimum(drawn, len(self.particles) - 1)]
        lost = max(0.0, 1.0 - self._fast / self._slow) if self._slow else 0.0
        if lost:
            stray = np.flatnonzero(self._random.random(limit) < lost)
            found[stray] = self._field.anywhere(len(stray), self._random)
            self._slow = self._fast = 0.0
        count = self._sufficient(found)
        self.particles = found[:count]
        self.weights = np.full(count, 1.0 / count)

    def _sufficient(self, particles: Array) -> int:
        """Return how many of these particles, in this order, suffice (Fox, 2003)."""
        _, first = np.unique(_keys(particles), return_index=True)
        new = np.zeros(len(particles))
        new[first] = 1.0
        more = np.maximum(np.cumsum(new) - 1.0, 1.0)
        part = 2.0 / (9.0 * more)
        z = self._settings.kld_z
        needed = more / (2.0 * self._settings.kld_err) * (1.0 - part + np.sqrt(part) * z) ** 3
        enough = np.arange(1, len(particles) + 1) >= np.maximum(
            needed, self._settings.min_particles
        )
        return int(enough.argmax()) + 1 if enough.any() else len(particles)

    def estimate(self) -> Estimate:
        """Return the mean of the particles near the heaviest place."""
        keys = _keys(self.particles)
        places, which = np.unique(keys, return_inverse=True)
        heaviest = np.bincount(which, self.weights, len(places)).argmax()
        near = which == heaviest
        for _ in range(3):
            pose = _mean(self.particles[near], self.weights[near])
            away = self.particles - pose
            wrap_yaws(away)
            near = (np.hypot(away[:, 0], away[:, 1]) < NEAR) & (np.abs(away[:, 2]) < NEAR_YAW)
        weights = self.weights[near]
        covariance: Array = (away[near].T * weights) @ away[near] / weights.sum()
        return Estimate(Pose(*pose.tolist()), covariance, float(weights.sum()))


def _keys(particles: Array) -> NDArray[np.int64]:
    """Return the bins of particles (n, 3) as (n,) numbers."""
    bins = np.floor(particles / BIN).astype(np.int64)
    keys: NDArray[np.int64] = (bins[:, 0] << 40) + (bins[:, 1] << 20) + bins[:, 2]
    return keys


def _mean(particles: Array, weights: Array) -> Array:
    """Return the mean pose (3,); headings are averaged on the circle."""
    x, y = np.average(particles[:, :2], axis=0, weights=weights)
    sin, cos = (np.average(f(particles[:, 2]), weights=weights) for f in (np.sin, np.cos))
    return np.array([x, y, math.atan2(sin, cos)])
