# SPDX-License-Identifier: BSD-3-Clause
"""The ids that windows and the command line propose: T1, T2, and so on."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_NUMBERED = re.compile(r"T(\d{1,9})")


def next_task_id(taken: Iterable[str]) -> str:
    """Return the next id of the series T1, T2, ... after all that are taken."""
    numbers = [int(match[1]) for name in taken if (match := _NUMBERED.match(name))]
    return f"T{max(numbers, default=0) + 1}"
