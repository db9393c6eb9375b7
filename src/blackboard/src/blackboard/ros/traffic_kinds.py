# SPDX-License-Identifier: BSD-3-Clause
"""The topics that robots, operators and the traffic planner use, and the core does not."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

import robot_description.msg as messages

if TYPE_CHECKING:
    from collections.abc import Mapping

    import genpy

TRAFFIC, ROUTES, TRAFFIC_STATE, ZONE_COMMAND = "traffic", "routes", "traffic_state", "zone_command"

TRAFFIC_KINDS: Mapping[str, type[genpy.Message]] = MappingProxyType(
    {
        TRAFFIC: messages.Traffic,
        ROUTES: messages.Routes,
        TRAFFIC_STATE: messages.TrafficState,
        ZONE_COMMAND: messages.ZoneCommand,
    }
)
"""Their types."""
