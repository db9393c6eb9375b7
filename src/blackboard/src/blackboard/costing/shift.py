# SPDX-License-Identifier: BSD-3-Clause
"""Notices that errors go to one side (Page, "Continuous Inspection Schemes", Biometrika 41, 1954).

This is the test of Page and Hinkley, for both sides. What is usual is learned: a gauge that shows
whole percents, or a crowded hall, is no change.
"""

from __future__ import annotations

from statistics import median

_LEARNING = 8
"""So many of the first errors do not count, nor after a change: they are being learned from."""


_LARGEST, _CHANGED = 3.0, 5.0
"""An error counts as so many usual ones at most: somebody stood in the way. When errors beyond
the usual one add up to so many, something has changed."""

_WEIGHT = 0.03
"""Weight of the last error in what is usual."""

_USUAL = 1.5
"""An error of so many mean ones is usual."""


class Shift:
    """Adds up relative errors beyond the usual ones.

    Args:
        least: An error of this share is usual, however small others have been.
    """

    def __init__(self, least: float) -> None:
        self._least = least
        self._mean = 0.0
        self._sums = [0.0, 0.0]
        self._first: list[float] = []

    def add(self, ratio: float) -> str:
        """Take in what something took, as a share of what was predicted.

        Returns:
            In words how much more or less it takes now; empty if nothing has changed. Then the
            test begins anew.
        """
        error = ratio - 1.0
        if len(self._first) < _LEARNING:
            self._first.append(abs(error))
            self._mean = median(self._first)
            return ""
        usual = max(self._least, _USUAL * self._mean)
        counted = min(max(error, -_LARGEST * usual), _LARGEST * usual)
        self._mean += _WEIGHT * (abs(counted) - self._mean)
        self._sums = [
            max(0.0, so_far + side * counted - usual)
            for side, so_far in zip((1.0, -1.0), self._sums, strict=True)
        ]
        if max(self._sums) < _CHANGED * usual:
            return ""
        self._sums = [0.0, 0.0]
        self._first = []
        return f"{abs(error):.0%} {'more' if error > 0.0 else 'less'}"
