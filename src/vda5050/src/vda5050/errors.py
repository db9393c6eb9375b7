# SPDX-License-Identifier: BSD-3-Clause
"""Errors of this package."""

from hive_common.errors import HiveError


class MessageError(HiveError):
    """A message is not what the standard allows.

    The text names the place in the message, the value found and what is allowed.
    """

    def __init__(self, kind: str, text: str) -> None:
        self.kind = kind  # one word for counting: size, json, schema, header
        super().__init__(text)


class BrokerError(HiveError):
    """The broker cannot be used as the settings say."""


class FaultError(HiveError):
    """A fault that a simulated AGV is asked for is none that it knows."""
