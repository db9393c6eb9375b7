# SPDX-License-Identifier: BSD-3-Clause
"""What can go wrong in this package, in words for the person who can mend it."""

from hive_common.errors import HiveError


class ModelError(HiveError):
    """A figure of a robot model contradicts another one."""
