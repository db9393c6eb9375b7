# SPDX-License-Identifier: BSD-3-Clause
"""Where robots charge."""

from typing import Annotated

import attrs

from hive_common.pose import Pose
from hive_common.structuring import Allowed, Name


@attrs.frozen(kw_only=True)
class Charger:
    """Where a robot stands to charge."""

    name: Name
    pose: Annotated[Pose, Allowed("[x, y, yaw] in the map frame [m, m, rad]")]
