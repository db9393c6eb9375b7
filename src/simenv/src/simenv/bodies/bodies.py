# SPDX-License-Identifier: BSD-3-Clause
"""The robots' bases: poses, velocities and odometry, all moved in one step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hive_common.pose import Pose
from simenv.bodies.motion import driven, limits_of, moved
from simenv.bodies.wheels import Wheels
from simenv.errors import CommandError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hive_common.geometry import Array
    from robot_description.models import RobotModel
    from simenv.bodies.contact import Contacts
    from simenv.noise import Noise

COMMAND_TIMEOUT = 0.5  # a base without a command for this long stops [s]

NOTHING = np.zeros((0, 3))


class Bodies:
    """The bases of all robots; row i of every array belongs to `names[i]`."""

    def __init__(self, contacts: Contacts, noise: Noise) -> None:
        """Begin without robots; `contacts` stops bases, `noise` is that of their wheels."""
        self._contacts = contacts
        self._wheels = Wheels(noise)
        self.names: list[str] = []  # the robots, in the order of their addition
        self._rows: dict[str, int] = {}
        self._models: list[RobotModel] = []
        self._limits = limits_of([])
        self._true = self._velocities = self._odometry = self._commands = NOTHING
        self._commanded_at = np.zeros(0)
        self._grip = np.zeros(0)
        self._frozen = np.zeros(0, dtype=bool)
        self._poses: dict[str, Pose] | None = {}

    @property
    def true(self) -> Array:
        """The true poses (n, 3), frame map [m, m, rad]."""
        return self._true

    @property
    def poses(self) -> Mapping[str, Pose]:
        """The true poses by name, frame map."""
        if self._poses is None:
            rows = zip(self.names, self._true.tolist(), strict=True)
            self._poses = {name: Pose(*row) for name, row in rows}
        return self._poses

    def row(self, name: str) -> int:
        """Return the row of a robot."""
        return self._rows[name]

    def add(self, name: str, model: RobotModel, pose: Pose, random: np.random.Generator) -> None:
        """Add a base at rest; `random` makes the noise of its wheels."""
        self.names.append(name)
        self._models.append(model)
        self._wheels.add(random)
        self._true = np.vstack([self._true, pose])
        still = np.zeros(3)
        self._velocities = np.vstack([self._velocities, still])
        self._odometry = np.vstack([self._odometry, still])
        self._commands = np.vstack([self._commands, still])
        self._commanded_at = np.append(self._commanded_at, -math.inf)
        self._grip = np.append(self._grip, 1.0)
        self._frozen = np.append(self._frozen, values=False)
        self._count()

    def remove(self, name: str) -> None:
        """Remove a base."""
        row = self._rows[name]
        del self.names[row], self._models[row]
        self._wheels.remove(row)
        self._true = np.delete(self._true, row, axis=0)
        self._velocities = np.delete(self._velocities, row, axis=0)
        self._odometry = np.delete(self._odometry, row, axis=0)
        self._commands = np.delete(self._commands, row, axis=0)
        self._commanded_at = np.delete(self._commanded_at, row)
        self._grip = np.delete(self._grip, row)
        self._frozen = np.delete(self._frozen, row)
        self._count()

    def _count(self) -> None:
        self._rows = {name: row for row, name in enumerate(self.names)}
        self._limits = limits_of(self._models)
        self._poses = None

    def put_back(self, name: str, pose: Pose) -> None:
        """Put a base at rest at a pose, with its odometry at zero as after switching on."""
        row = self._rows[name]
        self._true[row] = pose
        self._velocities[row] = self._odometry[row] = self._commands[row] = 0.0
        self._commanded_at[row] = -math.inf
        self._poses = None

    def slip(self, name: str, share: float) -> None:
        """Make wheels slip: `share` (0..1) of every shift moves nothing."""
        if not 0 <= share <= 1:
            raise CommandError(f"slip {share}; allowed: a share from 0 to 1")
        self._grip[self._rows[name]] = 1.0 - share

    def freeze(self, name: str, *, is_frozen: bool) -> None:
        """Make a base stop at once and ignore commands, or release it."""
        row = self._rows[name]
        self._frozen[row] = is_frozen
        if is_frozen:
            self._velocities[row] = 0.0

    def command(self, name: str, speed: tuple[float, float, float], time: float) -> None:
        """Command a base to move.

        Args:
            name: The robot.
            speed: vx, vy, wz in its base_footprint [m/s, m/s, rad/s].
            time: Now [s].

        Raises:
            CommandError: A speed is not a finite number.
        """
        if not all(map(math.isfinite, speed)):
            raise CommandError(f"{name}: speed {speed} is not a number; the command is ignored")
        row = self._rows[name]
        self._commands[row] = speed
        self._commanded_at[row] = time

    def step(self, time: float, loads: Sequence[float], dt: float) -> None:
        """Move all bases for `dt` [s] from `time` [s], with loads (n,) on board [kg]."""
        obeys = (time - self._commanded_at < COMMAND_TIMEOUT) & ~self._frozen
        if not (obeys.any() or self._velocities.any()):
            return
        self._velocities, shifts, ahead = driven(
            self._true,
            self._velocities,
            self._commands,
            obeys,
            self._limits,
            np.array(loads),
            self._grip,
            dt,
        )
        self._true, shares = self._contacts.advance(self._true, ahead, shifts)
        self._poses = None
        stopped = shares < 1.0
        if stopped.any():
            self._velocities[stopped] = 0.0
            shifts *= shares[:, None]
        self._odometry = moved(self._odometry, self._wheels.felt(shifts))

    def velocity(self, name: str) -> tuple[float, float, float]:
        """Return the velocity of a base in its own frame (vx, vy, wz) [m/s, m/s, rad/s]."""
        vx, vy, wz = self._velocities[self._rows[name]].tolist()
        return vx, vy, wz

    def odometry(self, name: str) -> Pose:
        """Return the pose that a base's wheels measure, from where it was put down."""
        return Pose(*self._odometry[self._rows[name]].tolist())
