# SPDX-License-Identifier: BSD-3-Clause
"""Names with numbers in them: in the order a person expects, and the next free one."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_DIGITS = 12
_NUMBERED = re.compile(r"T(\d{1,9})")


def next_task_id(taken: Iterable[str]) -> str:
    """Return the next id of the row T1, T2, ... behind all that are taken."""
    numbers = [int(match[1]) for name in taken if (match := _NUMBERED.match(name))]
    return f"T{max(numbers, default=0) + 1}"


@lru_cache(maxsize=10_000)
def padded(name: str) -> str:
    """Return a name whose plain order as a string puts T9 before T10."""
    return re.sub(r"\d+", lambda number: number[0].zfill(_DIGITS), name)
