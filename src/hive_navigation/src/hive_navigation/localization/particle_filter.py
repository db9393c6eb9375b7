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

from hive_common.compiled import compiled
from hive_common.pose import Pose
from hive_navigation.localization.odometry_model import spread, wrap_yaws

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hive_common.geometry import Array
    from hive_navigation.localization.amcl_settings import AmclSettings
    from hive_navigation.localization.likelihood_field import Beams, LikelihoodField

BIN_SIDE, BIN_ANGLE = 0.5, math.radians(10.0)
"""Size of the bins in which particles are counted [m], [rad]; those of ROS's amcl."""

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

    def change_map(self, field: LikelihoodField) -> None:
        """Weigh by another map of the same building, in the same frame, from now on.

        The cloud stays where it is. How likely scans were on the old map says nothing any more.
        """
        self._field = field
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
        settings, limit = self._settings, self._settings.max_particles
        bounds = np.cumsum(self.weights)
        draws = self._random.random(limit) * bounds[-1]
        lost = max(0.0, 1.0 - self._fast / self._slow) if self._slow else 0.0
        strays = np.empty((0, 3))
        if lost:
            chosen = np.flatnonzero(self._random.random(limit) < lost)
            strays = np.full((limit, 3), np.nan)
            strays[chosen] = self._field.anywhere(len(chosen), self._random)
            self._slow = self._fast = 0.0
        kld = (float(settings.kld_err), float(settings.kld_z))
        found = _drawn(self.particles, bounds, draws, strays, kld, settings.min_particles)
        self.particles = found
        self.weights = np.full(len(found), 1.0 / len(found))

    def estimate(self) -> Estimate:
        """Return the mean of the particles near the heaviest place."""
        keys = _keys(self.particles)
        places, which = np.unique(keys, return_inverse=True)
        heaviest = np.bincount(which, self.weights, len(places)).argmax()
        pose, covariance, share = _around(self.particles, self.weights, which == heaviest)
        return Estimate(Pose(*pose.tolist()), covariance, share)


def _keys(particles: Array) -> NDArray[np.int64]:
    """Return the bins of particles (n, 3) as (n,) numbers."""
    bins = np.floor(particles / (BIN_SIDE, BIN_SIDE, BIN_ANGLE)).astype(np.int64)
    keys: NDArray[np.int64] = (bins[:, 0] << 40) + (bins[:, 1] << 20) + bins[:, 2]
    return keys


@compiled(
    "float64[:, ::1](float64[:, ::1], float64[::1], float64[::1], float64[:, ::1],"
    " UniTuple(float64, 2), int64)"
)
def _drawn(
    particles: Array,
    bounds: Array,
    draws: Array,
    strays: Array,
    kld: tuple[float, float],
    least: int,
) -> Array:
    """Return as many of the drawn particles as suffice (Fox, 2003).

    Args:
        particles: (n, 3) to draw from.
        bounds: (n,) cumulated weights.
        draws: (k,) random numbers below the last bound.
        strays: (k, 3) poses to take instead, NaN where none is; or (0, 3).
        kld: `kld_err` and `kld_z`.
        least: Draw at least this many.
    """
    found = np.empty((len(draws), 3))
    bins = set()
    for index in range(len(draws)):
        drawn = min(np.searchsorted(bounds, draws[index]), len(particles) - 1)
        found[index] = particles[drawn]
        if len(strays) > 0 and not math.isnan(strays[index, 0]):
            found[index] = strays[index]
        x, y, yaw = found[index]
        column, row = math.floor(x / BIN_SIDE), math.floor(y / BIN_SIDE)
        bins.add((column << 40) + (row << 20) + math.floor(yaw / BIN_ANGLE))
        more = max(len(bins) - 1.0, 1.0)
        part = 2.0 / (9.0 * more)
        needed = more / (2.0 * kld[0]) * (1.0 - part + math.sqrt(part) * kld[1]) ** 3
        if index + 1 >= max(needed, least):
            return found[: index + 1]
    return found


@compiled(
    "Tuple((float64[::1], float64[:, ::1], float64))(float64[:, ::1], float64[::1], boolean[::1])"
)
def _around(
    particles: Array, weights: Array, near: NDArray[np.bool_]
) -> tuple[Array, Array, float]:
    """Return the mean pose (3,) around some particles, its covariance (3, 3) and its weight."""
    pose, covariance, total = np.zeros(3), np.zeros((3, 3)), 0.0
    chosen = near.copy()
    for _ in range(3):
        total, x, y, sin, cos = 0.0, 0.0, 0.0, 0.0, 0.0
        for index in range(len(particles)):
            if chosen[index]:
                weight, yaw = weights[index], particles[index, 2]
                total += weight
                x += weight * particles[index, 0]
                y += weight * particles[index, 1]
                # Headings are averaged on the circle.
                sin += weight * math.sin(yaw)
                cos += weight * math.cos(yaw)
        pose[:] = x / total, y / total, math.atan2(sin / total, cos / total)
        covariance[:], total = 0.0, 0.0
        for index in range(len(particles)):
            dx, dy = particles[index, 0] - pose[0], particles[index, 1] - pose[1]
            turn = (particles[index, 2] - pose[2] + np.pi) % (2 * np.pi) - np.pi
            chosen[index] = math.hypot(dx, dy) < NEAR and abs(turn) < NEAR_YAW
            if chosen[index]:
                weight = weights[index]
                total += weight
                away = (dx, dy, turn)
                for row in range(3):
                    for column in range(3):
                        covariance[row, column] += weight * away[row] * away[column]
    return pose, covariance / total, total
