# SPDX-License-Identifier: BSD-3-Clause
"""Maps that come as messages: what cannot be used is refused in one line."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("rospy")

from nav_msgs.msg import OccupancyGrid

from hive_common.errors import MapError
from hive_common.ros.conversions import grid_from_msg, map_from_msg, quaternion_of

READERS = pytest.mark.parametrize("read", [grid_from_msg, map_from_msg])


def message(**info: object) -> OccupancyGrid:
    """Return a map of 2 x 3 cells at (1, 2), with other figures where they are given."""
    made = OccupancyGrid(data=[0, 100, -1, 49, 50, 0])
    made.info.width, made.info.height, made.info.resolution = 2, 3, 0.5
    made.info.origin.position.x, made.info.origin.position.y = 1.0, 2.0
    made.info.origin.orientation = quaternion_of(0.0)
    for name, value in info.items():
        setattr(made.info, name, value)
    return made


def test_a_map_has_its_cells_where_its_origin_says() -> None:
    grid = grid_from_msg(message())

    assert grid.blocked.tolist() == [[False, True], [True, False], [True, False]]
    assert grid.bounds == (1.0, 2.0, 2.0, 3.5)


@READERS
def test_a_map_that_is_turned_is_refused_with_its_yaw_and_what_to_do(read) -> None:
    turned = message()
    turned.info.origin.orientation = quaternion_of(0.3)

    with pytest.raises(MapError, match=r"a yaw of 0\.3 rad; allowed: 0; turn the map's image"):
        read(turned)


@READERS
@pytest.mark.parametrize("info", [{"width": 3}, {"resolution": 0.0}, {"resolution": math.nan}])
def test_a_map_whose_figures_contradict_each_other_is_refused(read, info) -> None:
    with pytest.raises(MapError, match="the message holds 6 cells"):
        read(message(**info))
