# SPDX-License-Identifier: BSD-3-Clause
"""The topics of traffic, which are no topics of the core."""

import genpy
import robot_description.msg as messages


def traffic_kinds() -> dict[str, type[genpy.Message]]:
    """Return the topics that robots, operators and the traffic planner use, with their types."""
    return {
        "traffic": messages.Traffic,
        "routes": messages.Routes,
        "traffic_state": messages.TrafficState,
        "zone_command": messages.ZoneCommand,
    }
