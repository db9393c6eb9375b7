# SPDX-License-Identifier: BSD-3-Clause
"""A field for a number."""

from __future__ import annotations

from python_qt_binding.QtWidgets import QDoubleSpinBox

DECIMALS = 6
"""Digits behind the point that a number from a file keeps."""


class Number(QDoubleSpinBox):
    """A number with as many decimals as it needs: 5 and 0.25, not 5.00; nothing is rounded away.

    Args:
        properties: Of QDoubleSpinBox, such as the maximum.
    """

    def __init__(self, **properties: object) -> None:
        super().__init__(decimals=DECIMALS, **properties)

    def textFromValue(self, value: float) -> str:  # noqa: N802  (Qt's name)
        """Return the number without meaningless zeros."""
        text: str = super().textFromValue(value)
        zero, point = self.locale().zeroDigit(), self.locale().decimalPoint()
        return text.rstrip(zero).rstrip(point) if point in text else text
