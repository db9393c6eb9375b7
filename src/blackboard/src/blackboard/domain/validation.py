# SPDX-License-Identifier: BSD-3-Clause
"""Refuses NaN, infinity, absurd numbers, and endless names and lists in values from outside."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING

from blackboard.domain.record import ANY_ASSIGNMENT, MAX_TEXT
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_NAME = 256
"""Characters of a name or an id."""

MAX_ITEMS = 10_000
"""Items of one list; no hive has more robots, and no robot more tasks."""


MAX_NUMBER = 1e12
"""Greatest magnitude of a number, whatever its unit: a time since 1970 is some 2e9 s. One can
calculate with what is smaller, without an overflow."""

MAX_COUNT = 2**31
"""Greatest epoch, version, or number of an auction or assignment. Each grows by one, so no hive
gets so far, and one can go on counting from there without leaving the field of a message."""


def flaw_of(value: object, name: str) -> str:
    """Return what is wrong with a value or with anything in it; empty if nothing is."""
    if isinstance(value, str) and not isinstance(value, Enum):
        longest = MAX_TEXT if name.endswith((".reason", ".refusal")) else MAX_NAME
        flawed = len(value) > longest
        return f"{name} has {len(value)} characters; allowed: at most {longest}" * flawed
    if isinstance(value, float | int):
        return _number_flaw(value, name)
    if isinstance(value, tuple) and len(value) > MAX_ITEMS:
        return f"{name} has {len(value)} items; allowed: at most {MAX_ITEMS}"
    if isinstance(value, Pose) and (flaw := value.flaw):
        return f"{name} ({value.x:g}, {value.y:g}, {value.yaw:g}) {flaw}"
    for each, where in _inside(value, name):
        if flaw := flaw_of(each, where):
            return flaw
    return ""


def _number_flaw(value: float, name: str) -> str:
    if isinstance(value, float):
        allowed = f"allowed: finite numbers of at most {MAX_NUMBER:g}"
        return f"{name} is {value}; {allowed}" * (not _is_moderate(value))
    is_any = value == ANY_ASSIGNMENT and name.endswith(".assignment")
    return f"{name} is {value}; allowed: at most {MAX_COUNT}" * (value > MAX_COUNT and not is_any)


def _inside(value: object, name: str) -> Iterable[tuple[object, str]]:
    """Return what is in a value and not plain, with a name for it."""
    # `dataclasses.fields` takes ten times as long; a Pose has `_fields`.
    fields = getattr(value, "__dataclass_fields__", None) or getattr(value, "_fields", None)
    if fields is not None:
        items = [(getattr(value, key), key) for key in fields]
        return [(each, f"{name}.{key}") for each, key in items if not _is_plain(each)]
    if isinstance(value, tuple):
        return [(each, name) for each in value if not _is_plain(each)]
    if isinstance(value, Mapping):
        return (tuple(value), name), (tuple(value.values()), name)
    return ()


def _is_plain(value: object) -> bool:
    """Return whether nothing can be wrong with a number, or a text of any purpose."""
    kind = type(value)
    if kind is float:
        return _is_moderate(value)  # type: ignore[arg-type]  # a float
    if kind is str:
        return len(value) <= MAX_NAME  # type: ignore[arg-type]  # a str
    if kind is int:
        return value <= MAX_COUNT  # type: ignore[operator]  # an int
    return kind is bool


def _is_moderate(value: float) -> bool:
    return -MAX_NUMBER <= value <= MAX_NUMBER  # NaN is not
