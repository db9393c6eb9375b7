# SPDX-License-Identifier: BSD-3-Clause
"""The named places of the hive's building, which the launch of the fleet keeps as a parameter."""

from __future__ import annotations

import contextlib
from typing import Any

import rospy

from hive_common.pose import Pose

PARAMETER = "places"
"""In the hive's namespace: a list of `{name, pose}`, where a pose is [x, y, yaw] in m, m and rad,
map frame."""


def hive_places() -> dict[str, Pose]:
    """Return the places by name; none where the parameter is missing. Odd entries are left out."""
    found: Any = []
    with contextlib.suppress(rospy.ROSException, OSError):
        found = rospy.get_param(PARAMETER, [])
    places = {}
    for each in found if isinstance(found, list) else ():
        with contextlib.suppress(KeyError, TypeError, ValueError):
            places[str(each["name"])] = Pose(*map(float, each["pose"]))
    return {name: pose for name, pose in places.items() if not pose.flaw}
