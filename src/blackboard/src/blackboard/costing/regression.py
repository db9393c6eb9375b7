# SPDX-License-Identifier: BSD-3-Clause
"""Recursive least squares (Ljung, "System Identification", 1999, section 11.2)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence


class Regression:
    """Recursive least squares on relative errors: `terms * values` is about the total.

    Args:
        values: What each term counts, to begin with.
        uncertainty: How far off each may be.
        spread: By which share a total differs from the next one like it.
        covariance: What is known of that already.
    """

    MAX_ERROR = 0.3
    """A total that is off by more counts as off by this share, or by three times the uncertainty
    if that is more: somebody stood in the way."""

    FORGETTING = 0.99
    """Weight of what was learned after the next total."""

    def __init__(
        self,
        values: Sequence[float],
        uncertainty: Sequence[float],
        spread: float,
        covariance: Sequence[Sequence[float]] = (),
    ) -> None:
        self._uncertainty, self._spread = uncertainty, spread
        self.values = np.array(values, dtype=np.float64)
        self._covariance = np.array(covariance or np.diag(np.square(uncertainty)))

    @property
    def covariance(self) -> tuple[tuple[float, ...], ...]:
        """How well the values are known."""
        return tuple(map(tuple, self._covariance.tolist()))

    def learn(self, terms: Sequence[float], total: float) -> float:
        """Learn from a total above 0; return it as a share of what was expected.

        Where nothing was expected it is 1.
        """
        expected = float(np.dot(terms, self.values))
        share = np.array(terms) / total
        # Rounding may leave a variance just below 0.
        variance = max(0.0, float(share @ self._covariance @ share))
        most = max(self.MAX_ERROR, 3.0 * math.sqrt(variance))
        error = float(np.clip(1.0 - share @ self.values, -most, most))
        gain = self._covariance @ share / (self.FORGETTING * self._spread**2 + variance)
        self.values = self.values + gain * error
        left = self._covariance - np.outer(gain, share @ self._covariance)
        # A term that is never there must not become ever less certain.
        forgets = np.diag(left) / self.FORGETTING <= np.square(self._uncertainty)
        widen = np.where(forgets, self.FORGETTING**-0.5, 1.0)
        self._covariance = left * np.outer(widen, widen)
        return total / expected if expected > 0.0 else 1.0

    def doubt(self) -> None:
        """Take the values for as uncertain as at the start: things have changed."""
        self._covariance = np.diag(np.square(self._uncertainty))
