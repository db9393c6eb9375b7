# SPDX-License-Identifier: BSD-3-Clause
"""Which traffic planner to believe, by the epochs that they state."""

from __future__ import annotations

import math

SILENCE = 5.0
"""A planner that has not been heard for so long may be replaced by one of a lower epoch [s]."""


class NewestEpoch:
    """Admits the word of the newest planner.

    A hive that was bootstrapped again counts epochs from the beginning, so lower ones count again
    once the highest has been silent for `SILENCE`, or time was set back.
    """

    def __init__(self) -> None:
        self._epoch = 0
        self._heard_at = -math.inf

    def admits(self, epoch: int, now: float) -> bool:
        """Return whether a planner of an epoch counts that is heard at a time [s]."""
        if epoch < self._epoch and 0.0 <= now - self._heard_at < SILENCE:
            return False
        self._epoch, self._heard_at = epoch, now
        return True
