# SPDX-License-Identifier: BSD-3-Clause
"""What can go wrong in this package, in words for the person who can mend it."""

from hive_common.errors import HiveError


class SimenvError(HiveError):
    """The base of every error that this package raises."""


class SpawnError(SimenvError):
    """A robot cannot be put where, or under the name, that was asked for."""


class ObstacleError(SimenvError):
    """A door or a thing in the way is not known, or cannot be put where a robot stands."""


class FaultError(SimenvError):
    """There is no such fault, or its value makes no sense."""


class UnknownRobotError(SimenvError):
    """There is no robot of that name in the simulation."""


class CommandError(SimenvError):
    """A robot is told to do what cannot be done: a speed that is no number, a pick without arm."""
