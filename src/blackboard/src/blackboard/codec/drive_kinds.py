# SPDX-License-Identifier: BSD-3-Clause
"""The topics that tell other machines where a robot is and where it drives, for display."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Path

if TYPE_CHECKING:
    from collections.abc import Mapping

    import genpy

POSE, PLAN = "amcl_pose", "plan"
"""Topics of a robot, between machines: its pose (geometry_msgs/PoseWithCovarianceStamped) and its
planned path (nav_msgs/Path), which each robot's own ROS may call otherwise."""

KINDS: Mapping[str, type[genpy.Message]] = MappingProxyType(
    {POSE: PoseWithCovarianceStamped, PLAN: Path}
)
"""Their types."""
