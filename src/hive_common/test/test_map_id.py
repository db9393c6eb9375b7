# SPDX-License-Identifier: BSD-3-Clause
"""By what maps are told apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_common.map_id import NO_MAP, MapId, checksum_of
from hive_common.pose import Pose


def chart() -> GridMap:
    cells = np.zeros((20, 30), dtype=np.int8)
    cells[3, 4], cells[5, 6] = 100, -1
    return GridMap(cells, 0.05, Pose(-1.0, 2.0))


def _with_a_wall() -> GridMap:
    cells = chart().cells.copy()
    cells[0, 0] = 100
    return replace(chart(), cells=cells)


CHANGES = {
    "a cell": _with_a_wall(),
    "the resolution": replace(chart(), resolution=0.1),
    "the origin": replace(chart(), origin=Pose(-1.0, 2.05)),
    "the shape": replace(chart(), cells=chart().cells.reshape(30, 20)),
}


@pytest.mark.parametrize("other", CHANGES.values(), ids=CHANGES)
def test_maps_that_differ_have_different_checksums(other: GridMap) -> None:
    assert checksum_of(other) != checksum_of(chart())


def test_the_checksum_is_the_same_in_every_process() -> None:
    assert checksum_of(chart()) == checksum_of(chart()) == "010270bf"


def test_rounding_on_the_way_through_a_message_changes_no_checksum() -> None:
    rounded = replace(chart(), resolution=float(np.float32(0.05)), origin=Pose(-1.0, 2.0 + 1e-9))

    assert checksum_of(rounded) == checksum_of(chart())
    assert checksum_of(replace(chart(), origin=Pose(-0.0, 0.0))) == checksum_of(
        replace(chart(), origin=Pose(0.0, 0.0))
    )


@pytest.mark.parametrize(
    ("used", "words"),
    [
        (MapId("hall", "0a1b2c3d"), "map 'hall' (0a1b2c3d)"),
        (MapId("", "0a1b2c3d"), "map 0a1b2c3d"),
        (NO_MAP, "no map"),
    ],
)
def test_a_map_is_named_in_words(used: MapId, words: str) -> None:
    assert str(used) == words


def test_only_maps_that_are_known_differ() -> None:
    hall, other = MapId("hall", "01"), MapId("hall", "02")

    assert hall.differs(other)
    assert not hall.differs(MapId("renamed", "01"))
    assert not hall.differs(NO_MAP)
    assert not NO_MAP.differs(hall)
