# SPDX-License-Identifier: BSD-3-Clause
"""Checks the numbers in a dataclass of settings whose fields are named like ROS parameters."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from hive_common.errors import ParameterError

if TYPE_CHECKING:
    from collections.abc import Collection

MOST = 1e6
"""More than any setting of a robot is, and little enough for a memory to hold as many things."""


def check_numbers(
    settings: Any,  # noqa: ANN401  (any dataclass)
    above_zero: Collection[str] = (),
    at_least_zero: Collection[str] = (),
    shares: Collection[str] = (),
) -> None:
    """Check that every number of a dataclass is in its range, and at most `MOST` from 0.

    Args:
        settings: The dataclass; its texts are not checked.
        above_zero: Fields that must be above 0.
        at_least_zero: Fields that must be at least 0.
        shares: Fields that must be from 0 to 1.

    Raises:
        ParameterError: A number is out of its range.
    """
    for name in (field.name for field in fields(settings)):
        value = getattr(settings, name)
        if isinstance(value, str):
            continue
        good = not isinstance(value, bool) and abs(value) <= MOST
        allowed = "a finite number"
        if name in above_zero:
            good, allowed = good and value > 0, "a number above 0"
        elif name in at_least_zero:
            good, allowed = good and value >= 0, "a number of at least 0"
        elif name in shares:
            good, allowed = good and 0 <= value <= 1, "a number from 0 to 1"
        if abs(value) > MOST:
            allowed = f"{allowed}, at most {MOST:g}"
        if not good:
            raise ParameterError(f"{name}: {value!r:.80}; allowed: {allowed}")
