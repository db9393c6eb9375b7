# SPDX-License-Identifier: BSD-3-Clause
"""What can go wrong in this package, in words for the person who can mend it."""


class RobotDescriptionError(Exception):
    """The base of every error that this package raises."""


class FileError(RobotDescriptionError):
    """A file is missing, cannot be read, or holds something that is not allowed.

    The text is one line: file, line, key, the value found, what is allowed.
    """


class ModelError(RobotDescriptionError):
    """A figure of a robot model contradicts another one."""
