# SPDX-License-Identifier: BSD-3-Clause
"""Maps that come as messages: as those of files, turned or not, or refused in one line."""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

pytest.importorskip("rospy")

from geometry_msgs.msg import Pose as PoseMsg
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import OccupancyGrid
from rospy.numpy_msg import numpy_msg
from std_msgs.msg import Header

from hive_common.errors import MapError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.map_file import load_map, load_turned_map, save_map
from hive_common.ros.conversions import grid_from_msg, map_from_msg, map_msg, quaternion_of

if TYPE_CHECKING:
    from pathlib import Path

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


@pytest.mark.parametrize("yaw", [0.3, math.pi / 4, -math.pi / 2, 3.1416, 1.0, 6.283185, 100.0])
def test_a_map_s_file_and_the_message_made_of_it_are_the_same_map(
    tmp_path: Path, yaw: float
) -> None:
    random = np.random.default_rng(1)
    cells = random.choice([FREE, 30, OCCUPIED, UNKNOWN], (60, 90)).astype(np.int8)
    save_map(GridMap(cells, 0.05), tmp_path / "m")
    text = (tmp_path / "m.yaml").read_text()
    (tmp_path / "m.yaml").write_text(text.replace("[0, 0, 0]", f"[2, -3, {yaw}]"))

    read = load_map(str(tmp_path / "m.yaml"))
    sent = through_a_connection(map_msg(Header(), load_turned_map(str(tmp_path / "m.yaml"))))

    assert (sent.info.width, sent.info.height) == (90, 60)
    heard = map_from_msg(sent)
    assert (heard.cells == read.cells).all()
    assert heard.resolution == pytest.approx(read.resolution)
    assert heard.origin == pytest.approx(read.origin)


def through_a_connection(sent: OccupancyGrid) -> OccupancyGrid:
    """Return what a node receives of a message: figures in single precision, cells as an array."""
    buffer = io.BytesIO()
    sent.serialize(buffer)
    received: OccupancyGrid = numpy_msg(OccupancyGrid)()
    received.deserialize(buffer.getvalue())
    return received


@READERS
def test_a_map_that_is_turned_becomes_one_with_its_cells_where_they_were(read) -> None:
    turned = message()
    turned.info.origin.orientation = quaternion_of(math.pi / 2)

    grid = read(turned)

    assert grid.blocked.shape == (2, 3)
    assert grid.bounds == pytest.approx((-0.5, 2.0, 1.0, 3.0))
    assert grid.blocked[grid.cell((0.75, 2.75))]
    assert grid.blocked[grid.cell((0.25, 2.25))]
    assert not grid.blocked[grid.cell((0.75, 2.25))]


@READERS
@pytest.mark.parametrize("turn", [(1.0, 0.0, 0.0, 0.0), (0.0, 0.1, 0.0, 0.995)])
def test_a_map_that_is_tilted_is_refused_in_one_line(read, turn) -> None:
    tilted = message()
    tilted.info.origin.orientation = Quaternion(*turn)

    with pytest.raises(MapError, match=r"tilted by .* rad; allowed: a turn about z") as caught:
        read(tilted)
    assert "\n" not in str(caught.value)


@READERS
def test_a_map_whose_orientation_is_no_rotation_is_refused(read) -> None:
    with pytest.raises(MapError, match=r"the map's origin: orientation .* is not a rotation"):
        read(message(origin=PoseMsg()))


@READERS
@pytest.mark.parametrize("info", [{"width": 3}, {"resolution": 0.0}, {"resolution": math.nan}])
def test_a_map_whose_figures_contradict_each_other_is_refused(read, info) -> None:
    with pytest.raises(MapError, match="the message holds 6 cells"):
        read(message(**info))
