# SPDX-License-Identifier: BSD-3-Clause
"""What can go wrong for an operator, each kind with the exit code that a script can rely on."""

from hive_common.errors import HiveError


class FleetManagerError(HiveError):
    """The base of every error that this package raises; its text is one line for a person.

    Attributes:
        exit_code: What the `hive` command ends with when this error reaches the top.
    """

    exit_code = 1


class NotDoneError(FleetManagerError):
    """The hive answered, and the answer is no: rejected, failed, cancelled, or no such task."""

    exit_code = 1


class InputError(FleetManagerError):
    """An argument or a file of the user's cannot be used."""

    exit_code = 2


class NoHiveError(FleetManagerError):
    """No ROS master or no blackboard answers."""

    exit_code = 3


class TimeUpError(FleetManagerError):
    """What was waited for did not happen within the time that the user allowed."""

    exit_code = 4


class StartError(FleetManagerError):
    """A hive that was to be started did not come up."""

    exit_code = 5
