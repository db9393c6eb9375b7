# SPDX-License-Identifier: BSD-3-Clause
"""The errors of this package, in words for the person who can fix them."""

from hive_common.errors import HiveError


class SimenvError(HiveError):
    """The base of every error that this package raises."""


class SpawnError(SimenvError):
    """A robot cannot have the place or the name asked for."""


class ObstacleError(SimenvError):
    """A door or obstacle is unknown, or a robot stands where it should go."""


class FaultError(SimenvError):
    """A fault is unknown, or its value is not allowed."""


class UnknownRobotError(SimenvError):
    """The simulation has no robot of that name."""


class CommandError(SimenvError):
    """A robot cannot follow a command: a speed is not finite, or it has no arm to pick with."""
