# SPDX-License-Identifier: BSD-3-Clause
"""Reads private parameters of a node, each checked where it is read."""

from __future__ import annotations

import math

import rospy

from hive_common.errors import ParameterError


def text(name: str, default: str | None = None) -> str:
    """Return a private parameter that is a text; without a default it must be there."""
    value = str(rospy.get_param(f"~{name}", "" if default is None else default))
    if not value:
        raise ParameterError(f"parameter ~{name} is missing; give it as _{name}:=...")
    return value


def number(name: str, *, least: float, most: float, default: float | None = None) -> float:
    """Return a private parameter that is a number; without a default it must be there."""
    value = rospy.get_param(f"~{name}", default)
    if value is None:
        raise ParameterError(f"parameter ~{name} is missing; give it as _{name}:=...")
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not (good and least <= value <= most):
        raise ParameterError(
            f"parameter ~{name}: {value}; allowed: a number from {least:g} to {most:g}"
        )
    return float(value)


def whole_number(name: str, *, least: int, most: int, default: int) -> int:
    """Return a private parameter that is a whole number."""
    value = number(name, least=least, most=most, default=default)
    if value != int(value):
        raise ParameterError(f"parameter ~{name}: {value}; allowed: a whole number")
    return int(value)
