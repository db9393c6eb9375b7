# SPDX-License-Identifier: BSD-3-Clause
"""Reads the fixed joints of a URDF, so that one process can publish those of many robots."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import NamedTuple

Numbers = tuple[float, ...]


class FixedJoint(NamedTuple):
    """Where a link is fixed to another."""

    parent: str  # frame
    child: str  # frame
    position: Numbers  # x, y, z of the child in the parent [m]
    rotation: Numbers  # quaternion x, y, z, w


def fixed_joints(urdf: str) -> list[FixedJoint]:
    """Return the fixed joints of a robot; all joints of our models are fixed."""
    joints = []
    for joint in ET.fromstring(urdf).iter("joint"):  # noqa: S314  (made by robot_urdf)
        parent, child, origin = (joint.find(each) for each in ("parent", "child", "origin"))
        if joint.get("type") != "fixed" or parent is None or child is None:
            continue
        at = {} if origin is None else origin.attrib
        position, angles = (_numbers(at.get(name, "0 0 0")) for name in ("xyz", "rpy"))
        joints.append(
            FixedJoint(parent.attrib["link"], child.attrib["link"], position, _quaternion(*angles))
        )
    return joints


def _numbers(text: str) -> Numbers:
    return tuple(map(float, text.split()))


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
