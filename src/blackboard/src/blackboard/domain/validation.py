# SPDX-License-Identifier: BSD-3-Clause
"""Refuses NaN, infinity and endless names and lists in values from outside."""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_NAME = 256
"""Characters of a name or an id."""

MAX_TEXT = 10_000
"""Characters of a reason, which may mention each of a hundred robots."""

MAX_ITEMS = 10_000
"""Items of one list; no hive has more robots, and no robot more tasks."""


def flaw_of(value: object, name: str) -> str:
    """Return what is wrong with a value or with anything in it; empty if nothing is."""
    if isinstance(value, str) and not isinstance(value, Enum):
        longest = MAX_TEXT if name.endswith((".reason", ".refusal")) else MAX_NAME
        flawed = len(value) > longest
        return f"{name} has {len(value)} characters; allowed: at most {longest}" * flawed
    if isinstance(value, float):
        return f"{name} is {value}; allowed: finite numbers" * (not math.isfinite(value))
    inner: Iterable[tuple[object, str]] = ()
    if isinstance(value, tuple):
        if len(value) > MAX_ITEMS:
            return f"{name} has {len(value)} items; allowed: at most {MAX_ITEMS}"
        if all(type(each) is str and len(each) <= MAX_NAME for each in value):
            return ""  # Fast path for the most frequent value: the tasks on a robot's list.
        if all(type(each) is float and math.isfinite(each) for each in value):
            return ""  # Fast path: when each robot was heard, in every heartbeat.
        keys = getattr(value, "_fields", None)  # a Pose has names
        if keys is None:
            inner = ((each, name) for each in value)
        else:
            inner = ((getattr(value, key), f"{name}.{key}") for key in keys)
    elif (names := getattr(value, "__dataclass_fields__", None)) is not None:
        # `fields` takes ten times as long, and nearly all values are plain.
        fields = ((getattr(value, each), each) for each in names)
        inner = ((each, f"{name}.{key}") for each, key in fields if not _is_plain(each))
    elif isinstance(value, Mapping):
        inner = ((tuple(value), name), (tuple(value.values()), name))
    return next(filter(None, (flaw_of(*each) for each in inner)), "")


def _is_plain(value: object) -> bool:
    """Return whether nothing can be wrong with a number, or a text of any purpose."""
    kind = type(value)
    if kind is float:
        return math.isfinite(value)  # type: ignore[arg-type]  # a float
    if kind is str:
        return len(value) <= MAX_NAME  # type: ignore[arg-type]  # a str
    return kind is int or kind is bool
