# SPDX-License-Identifier: BSD-3-Clause
"""The errors an operator may meet, each with the exit code that scripts rely on."""

from hive_common.errors import HiveError


class FleetManagerError(HiveError):
    """The base of every error of this package; its text is one line for a person.

    Attributes:
        exit_code: The exit code of the `hive` command.
    """

    exit_code = 1


class NotDoneError(FleetManagerError):
    """The hive answered, and the answer is no: rejected, failed, cancelled, or no such task."""

    exit_code = 1


class InputError(FleetManagerError):
    """An argument or a file cannot be used."""

    exit_code = 2


class NoHiveError(FleetManagerError):
    """No ROS master or no blackboard answers."""

    exit_code = 3


class TimeUpError(FleetManagerError):
    """Something did not happen within the user's timeout."""

    exit_code = 4


class StartError(FleetManagerError):
    """The hive did not start."""

    exit_code = 5
