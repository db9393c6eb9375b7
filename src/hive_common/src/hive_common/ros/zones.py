# SPDX-License-Identifier: BSD-3-Clause
"""Reads the zones of a hive from the ROS parameter in which the launch file leaves them."""

from __future__ import annotations

from hive_common.errors import ParameterError
from hive_common.ros.params import structured
from hive_common.zone import Zone


def zones_of(hive: str) -> tuple[Zone, ...]:
    """Return the hive's zones; none where they are not allowed, as the traffic planner says.

    ROS Parameters: `traffic_planner/zones` of the hive, whose namespace ends in a slash.
    """
    try:
        return structured(f"{hive}traffic_planner/zones", tuple[Zone, ...], [])
    except ParameterError:
        return ()
