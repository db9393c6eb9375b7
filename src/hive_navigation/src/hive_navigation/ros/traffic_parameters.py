# SPDX-License-Identifier: BSD-3-Clause
"""Reads the parameters of the traffic planner."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import rospy

from hive_common.errors import ParameterError
from hive_common.landmark import Landmark
from hive_common.ros.params import structured, whole_number
from hive_common.zone import Zone, with_closed
from hive_navigation.ros.conversions import HIGHEST_EPOCH

if TYPE_CHECKING:
    from collections.abc import Sequence


class TrafficParameters(NamedTuple):
    """What the traffic planner is told at its start.

    Attributes:
        epoch: Higher than that of any planner before.
        zones: As in the fleet file; those that are closed now say so.
        landmarks: Named places of the building.
    """

    epoch: int
    zones: tuple[Zone, ...]
    landmarks: tuple[Landmark, ...]

    @classmethod
    def read(cls) -> TrafficParameters:
        """Read them from the node's namespace.

        Raises:
            ParameterError: A parameter has a value that is not allowed.
        """
        zones = structured("~zones", tuple[Zone, ...], [])
        closed = _closed([zone.name for zone in zones if zone.closed])
        return cls(
            epoch=whole_number("epoch", least=1, most=HIGHEST_EPOCH, default=1),
            zones=with_closed(zones, closed),
            landmarks=structured("~places", tuple[Landmark, ...], []),
        )


def _closed(default: Sequence[str]) -> set[str]:
    """Return the names of the zones that are closed from the start."""
    names = rospy.get_param("~closed", default)
    if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
        raise ParameterError(f"parameter ~closed: {names!r}; allowed: a list of names of zones")
    return set(names)
