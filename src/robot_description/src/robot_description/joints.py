# SPDX-License-Identifier: BSD-3-Clause
"""Reads the fixed joints of a URDF, so that one process can publish those of many robots."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import NamedTuple

from hive_common.pose import FARTHEST
from hive_common.structuring import NotAllowedError

Numbers = tuple[float, ...]


class FixedJoint(NamedTuple):
    """Where a link is fixed to another."""

    parent: str  # frame
    child: str  # frame
    position: Numbers  # x, y, z of the child in the parent [m]
    rotation: Numbers  # quaternion x, y, z, w


def fixed_joints(urdf: str) -> list[FixedJoint]:
    """Return the fixed joints of a robot; all joints of our models are fixed.

    Raises:
        NotAllowedError: The text is not XML, or one of its fixed joints is not complete.
    """
    try:
        robot = ET.fromstring(urdf)  # noqa: S314  (of this robot's own launch file)
    except (ET.ParseError, ValueError) as error:
        raise NotAllowedError((), f"is not XML: {error}; allowed: a URDF") from None
    return [_joint(joint) for joint in robot.iter("joint") if joint.get("type") == "fixed"]


def _joint(joint: ET.Element) -> FixedJoint:
    """Return a fixed joint; raise NotAllowedError if something is missing or not allowed."""
    name = f"joint {joint.get('name', '')!r}"
    ends = [joint.find(each) for each in ("parent", "child")]
    links = ["" if end is None else end.get("link", "") for end in ends]
    if not all(links):
        raise NotAllowedError((name,), "needs a parent and a child, each with its link")
    origin = joint.find("origin")
    at = {} if origin is None else origin.attrib
    try:
        position, angles = (_numbers(at.get(key, "0 0 0")) for key in ("xyz", "rpy"))
    except ValueError as error:
        raise NotAllowedError((name, "origin"), str(error)) from None
    return FixedJoint(links[0], links[1], position, _quaternion(*angles))


def _numbers(text: str) -> Numbers:
    numbers = tuple(map(float, text.split()))
    if len(numbers) != 3 or not all(abs(number) <= FARTHEST for number in numbers):  # noqa: PLR2004
        raise ValueError(f"{text[:80]!r}; allowed: three numbers, each at most {FARTHEST:g}")
    return numbers


def _quaternion(roll: float, pitch: float, yaw: float) -> Numbers:
    (cr, sr), (cp, sp), (cy, sy) = (
        (math.cos(angle / 2), math.sin(angle / 2)) for angle in (roll, pitch, yaw)
    )
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
