# SPDX-License-Identifier: BSD-3-Clause
"""How values are written for a person: always with their unit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fleet_manager.desk.words import text

if TYPE_CHECKING:
    from hive_common.pose import Pose

_MINUTE, _HOUR, _DAY = 60, 3600, 86400


def duration(seconds: float | None) -> str:
    """Return a time span in the two units that matter, or a dash where it is unknown.

    Args:
        seconds: [s]; None or not finite means unknown, and less than 0 counts as 0.
    """
    if seconds is None or not math.isfinite(seconds):
        return text("value.unknown")
    whole = max(0, round(seconds))
    if whole < _MINUTE:
        return text("value.seconds", seconds=whole)
    if whole < _HOUR:
        return text("value.minutes", minutes=whole // _MINUTE, seconds=whole % _MINUTE)
    if whole < _DAY:
        return text("value.hours", hours=whole // _HOUR, minutes=whole % _HOUR // _MINUTE)
    return text("value.days", days=whole // _DAY, hours=whole % _DAY // _HOUR)


def mass(kilograms: float) -> str:
    """Return a mass [kg] with its unit, without zeros that say nothing."""
    return f"{kilograms:.10g} kg" if math.isfinite(kilograms) else text("value.unknown")


def charge_used(ampere_hours: float) -> str:
    """Return an electric charge [Ah] with its unit."""
    return f"{ampere_hours:.3f} Ah" if math.isfinite(ampere_hours) else text("value.unknown")


def percent(share: float) -> str:
    """Return a share from 0 to 1 in percent."""
    return f"{share * 100:.0f} %" if math.isfinite(share) else text("value.unknown")


def position(pose: Pose) -> str:
    """Return where a pose is [m, map frame]."""
    return text("value.position", x=pose.x, y=pose.y) if pose.is_finite else text("value.unknown")


def length(metres: float) -> str:
    """Return a length with its unit, to the centimetre."""
    return f"{metres:.2f} m"


def degrees(radians: float) -> str:
    """Return an angle [rad] in degrees, as people read headings."""
    return f"{math.degrees(radians):.0f}°"


def member(name: str) -> str:
    """Return the name of a member of the hive without the slash that ROS puts first."""
    return name.lstrip("/")
