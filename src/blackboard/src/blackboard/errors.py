# SPDX-License-Identifier: BSD-3-Clause
"""What can go wrong in this package, in words for the person who can mend it."""

from hive_common.errors import HiveError


class BlackboardError(HiveError):
    """The base of every error that this package raises."""


class TaskRefusedError(BlackboardError):
    """A posted task cannot enter the list; the text tells the operator why and what is allowed."""


class CharacteristicsError(BlackboardError):
    """A robot is described by a value that no robot can have; the text names it."""


class AllocationError(BlackboardError):
    """Robots and tasks to be allocated do not fit together."""


class SettingsError(BlackboardError):
    """A parameter has a value that is not allowed; the text names it and what is."""


class NoRouterError(BlackboardError):
    """No router of the hive answers; the text names those that were asked."""


class BidRefusedError(BlackboardError):
    """A bid does not answer the auction that is open, or is no number from 0 to MAX_COST."""


class SplitRefusedError(BlackboardError):
    """A task is too heavy for every robot and cannot be split; the text says why."""


class LiveHiveError(BlackboardError):
    """A hive of real processes did not do in time what is waited for; the text says what."""


class JournalError(BlackboardError):
    """A member's disk cannot be read or written; the text names the file and the remedy."""
