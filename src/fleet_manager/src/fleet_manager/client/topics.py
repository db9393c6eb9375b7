# SPDX-License-Identifier: BSD-3-Clause
"""The hive's topics that operators' programs follow."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blackboard.domain import talker as topics
from blackboard.domain.characteristics import RobotStatus

if TYPE_CHECKING:
    from collections.abc import Hashable

TRAFFIC_STATE = "traffic_state"
"""The topic on which the traffic planner tells who waits, once a second."""

ZONE_COMMAND = "zone_command"
"""The topic on which the traffic planner is told to close or open a zone."""

CHANGES = (topics.TASK_STATE, topics.ROBOT_STATUS, topics.BACKUP, TRAFFIC_STATE)
"""The topics that tell what changes."""

STATE = (*CHANGES, topics.SYNC)
"""The topics that tell the hive's state."""

AUCTIONS = (topics.NEW_TASK, topics.TASK_COST)
"""The topics that tell what is posted and bid."""


def superseded(topic: str, report: object) -> Hashable:
    """Return the name under which a newer report replaces an older one; None where all count."""
    if isinstance(report, RobotStatus):
        return topic, report.robot_id
    return topic if topic in {topics.SYNC, topics.BACKUP, TRAFFIC_STATE} else None
