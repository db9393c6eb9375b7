# SPDX-License-Identifier: BSD-3-Clause
"""Notices that errors go to one side (Page, "Continuous Inspection Schemes", Biometrika 41, 1954).

This is the test of Page and Hinkley, for both sides.
"""

from __future__ import annotations

_LEARNING = 8
"""So many of the first errors do not count, nor after a change: they are being learned from."""


class Shift:
    """Adds up relative errors beyond the usual ones.

    Args:
        usual: An error of this share is no sign of a change.
        largest: An error counts as this share at most: somebody stood in the way.
        changed: What the errors beyond the usual one add up to when something has changed.
    """

    def __init__(self, usual: float, largest: float, changed: float) -> None:
        self._usual, self._largest, self._changed = usual, largest, changed
        self._sums = [0.0, 0.0]
        self._waits = _LEARNING

    def add(self, ratio: float) -> str:
        """Take in what something took, as a share of what was predicted.

        Returns:
            In words how much more or less it takes now; empty if nothing has changed. Then the
            test begins anew.
        """
        if self._waits:
            self._waits -= 1
            return ""
        error = min(max(ratio - 1.0, -self._largest), self._largest)
        self._sums = [
            max(0.0, so_far + side * error - self._usual)
            for side, so_far in zip((1.0, -1.0), self._sums, strict=True)
        ]
        if max(self._sums) < self._changed:
            return ""
        self._sums = [0.0, 0.0]
        self._waits = _LEARNING
        return f"{abs(ratio - 1.0):.0%} {'more' if ratio > 1.0 else 'less'}"
