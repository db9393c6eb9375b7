# SPDX-License-Identifier: BSD-3-Clause
"""Landmarks: named places of a building, so that people are told where something happens."""

from typing import Annotated

import attrs

from hive_common.structuring import Allowed, Name


@attrs.frozen(kw_only=True)
class Landmark:
    """A place with a name: a station, a charger, a door."""

    name: Name
    at: Annotated[tuple[float, float], Allowed("[x, y] in the map frame [m]")]
    is_goal: bool = True
    """Whether robots are sent there."""
