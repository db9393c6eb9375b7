# SPDX-License-Identifier: BSD-3-Clause
"""How values are written for a person: always with their unit."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING

from blackboard.domain.task import TaskType

if TYPE_CHECKING:
    from hive_common.pose import Pose

UNKNOWN = "–"
_MINUTE, _HOUR, _DAY = 60, 3600, 86400
_DIGITS = 12
_TYPE_NAMES = {kind.value: kind.name for kind in TaskType}


def duration(seconds: float | None) -> str:
    """Return a time span [s] in the two units that matter; negative counts as 0."""
    if seconds is None or not math.isfinite(seconds):
        return UNKNOWN
    whole = max(0, round(seconds))
    if whole < _MINUTE:
        return f"{whole} s"
    if whole < _HOUR:
        return f"{whole // _MINUTE} min {whole % _MINUTE:02d} s"
    if whole < _DAY:
        return f"{whole // _HOUR} h {whole % _HOUR // _MINUTE:02d} min"
    return f"{whole // _DAY} d {whole % _DAY // _HOUR:02d} h"


def ago(moment: float, now: float) -> str:
    """Return how long ago a moment was; both are times of the hive [s], `now` is 0 if unknown.

    A moment may be ahead: from before the clock was set back, as a new simulation does.
    """
    if now <= 0:
        return UNKNOWN
    return (
        f"{duration(now - moment)} ago" if moment <= now + 1 else "before the clock was set back"
    )


def mass(kilograms: float) -> str:
    """Return a mass [kg] without meaningless zeros."""
    return f"{kilograms:.10g} kg" if math.isfinite(kilograms) else UNKNOWN


def charge_used(ampere_hours: float) -> str:
    """Return an electric charge [Ah]."""
    return f"{ampere_hours:.3f} Ah" if math.isfinite(ampere_hours) else UNKNOWN


def counted(number: int, what: str) -> str:
    """Return a number with what is counted: `1 task`, `2 tasks`."""
    return f"{number} {what}{'s' * (number != 1)}"


def percent(share: float) -> str:
    """Return a share from 0 to 1 in percent."""
    return f"{share * 100:.0f} %" if math.isfinite(share) else UNKNOWN


def position(pose: Pose) -> str:
    """Return the position of a pose [m, map frame]."""
    return f"{pose.x:.2f} m, {pose.y:.2f} m" if pose.is_finite else UNKNOWN


def length(metres: float) -> str:
    """Return a length to the centimetre."""
    return f"{metres:.2f} m"


def degrees(radians: float) -> str:
    """Return an angle [rad] in degrees, as people read headings."""
    return f"{math.degrees(radians):.0f}°"


def member(name: str) -> str:
    """Return the name of a member of the hive without ROS's leading slash."""
    return name.strip("/")


def type_name(number: int) -> str:
    """Return the short name of a task type, or its number where it has none."""
    return _TYPE_NAMES.get(number, str(number))


@lru_cache(maxsize=10_000)
def natural(name: str) -> str:
    """Return a sort key that puts T9 before T10."""
    return re.sub(r"\d+", lambda number: number[0].zfill(_DIGITS), name)
