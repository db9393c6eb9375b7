# SPDX-License-Identifier: BSD-3-Clause
"""The base of all errors that Robo-Hive raises on purpose, and errors of several packages.

Each text is one line for the person who can fix it: the value, what is allowed, what to do.
"""


class HiveError(Exception):
    """The base of every error that a package of this workspace raises on purpose."""


class FileError(HiveError):
    """A file is missing, cannot be read, or holds something that is not allowed.

    The text is one line: file, line, key, the value found, what is allowed.
    """


class MapError(HiveError):
    """A map cannot be found, read or written."""


class ParameterError(HiveError):
    """A ROS parameter is missing or has a value that is not allowed."""
