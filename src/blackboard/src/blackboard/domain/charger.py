# SPDX-License-Identifier: BSD-3-Clause
"""Where robots charge, and which robot has which charger."""

from dataclasses import dataclass
from typing import Annotated

import attrs

from hive_common.pose import Pose
from hive_common.structuring import Allowed, Name


@attrs.frozen(kw_only=True)
class Charger:
    """Where a robot stands to charge."""

    name: Name
    pose: Annotated[Pose, Allowed("[x, y, yaw] in the map frame [m, m, rad]")]


@dataclass(frozen=True, slots=True)
class Grant:
    """A charger that the hive has given to a robot (message ChargerGrant)."""

    charger: str  # its name
    robot: str = ""  # that may drive to it and stand at it; empty if nobody may any more
    since: float = 0.0  # `RobotStatus.charger_since` of the request that it answers [s]
    there: bool = False  # whether the robot stands at it, where it is in the way of all others
