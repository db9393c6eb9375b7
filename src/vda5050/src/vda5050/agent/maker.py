# SPDX-License-Identifier: BSD-3-Clause
"""A maker's file: what one make of AGV calls its actions, and where its maps lie.

The files in `makers/` are the manual of the format.
"""

from typing import Annotated, Any

import attrs

from hive_common.checked_yaml import read_checked
from hive_common.pose import Pose
from hive_common.resources import find_file
from hive_common.structuring import Allowed, Name
from vda5050.protocol.actions import DROP, PICK, START_CHARGING, STOP_CHARGING


@attrs.frozen(kw_only=True)
class MakersAction:
    """What a maker calls an action, and what it has to be told."""

    type: Name
    load_id: str = "loadId"
    """Key of the parameter that names the load; empty: it is not told."""
    load_mass: str = ""
    """Key of the parameter that says how heavy the load is [kg]; empty: it is not told."""
    parameters: dict[str, Any] = attrs.field(factory=dict)
    """Further parameters, such as `stationType: floor`."""


@attrs.frozen(kw_only=True)
class Actions:
    """The actions that the hive asks for."""

    pick: MakersAction = MakersAction(type=PICK)
    drop: MakersAction = MakersAction(type=DROP)
    start_charging: Name = START_CHARGING
    """Empty is not allowed: an AGV that charges by itself refuses it without harm."""
    stop_charging: Name = STOP_CHARGING


@attrs.frozen(kw_only=True)
class MapPlace:
    """Where a map of the AGVs lies in the hive's map."""

    id: Name
    pose: Annotated[Pose, Allowed("[x, y, yaw] of its origin in the hive's map [m, m, rad]")]


@attrs.frozen(kw_only=True)
class Maker:
    """What a make of AGVs does in its own way."""

    actions: Actions = Actions()
    maps: tuple[MapPlace, ...] = ()
    """Without any, the AGVs' coordinates are those of the hive's map, whatever its id."""
    map_id: Name = "map"
    """The id for orders before the AGV has told one of its own."""


def read_maker(name: str) -> Maker:
    """Read and check a maker's file, given by its name in `makers/` or by its path.

    Raises:
        hive_common.errors.FileError: There is no such file, or it has a mistake.
    """
    return read_checked(find_file("vda5050", "makers", name), Maker)
