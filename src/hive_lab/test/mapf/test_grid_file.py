# SPDX-License-Identifier: BSD-3-Clause
"""Files of the benchmark: what is read, and how a bad one is refused."""

import numpy as np
import pytest

from hive_common.errors import FileError
from hive_lab.mapf.grid_file import Cell, Trip, read_map, read_scenario, read_task_places

MAP = "type octile\nheight 2\nwidth 3\nmap\n.@.\nG.T\n"
LINE = "0\troom.map\t3\t2\t0\t0\t2\t0\t4\n"


@pytest.fixture
def write(tmp_path):
    """Write a text into a file and return its path."""

    def written(text, name="file"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return written


def test_a_map_is_read_with_its_upper_left_cell_first(write):
    grid = read_map(write(MAP))

    assert grid.free.tolist() == [[True, False, True], [True, True, False]]
    assert grid.cells.tolist() == [[0, 0], [2, 0], [0, 1], [1, 1]]
    assert grid.number(Cell(1, 1)) == 3


def test_a_map_needs_no_type_and_no_line_break_at_its_end(write):
    grid = read_map(write("height 1\nwidth 2\nmap\n.O"))

    assert grid.free.tolist() == [[True, False]]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("type octile\nheight two\nwidth 3\nmap\n", ":2: height is 'two'; allowed: a whole"),
        ("height 2\nwidth 0\nmap\n", ":2: width is '0'; allowed: a whole number from 1"),
        ("height 2\ncolour red\n", ":2: 'colour red'; allowed before the line `map`"),
        ("height 2\nmap\n..\n..\n", ":2: `width N` must come before `map`"),
        ("height 2\nwidth 2\n", ":3: the file ends before a line `map`"),
        (MAP + "...\n", ":7: 3 rows of cells; allowed: 2, the height"),
        (MAP.replace("G.T", "G.."[:2]), ":6: 2 cells; allowed: 3, the width"),
        (MAP.replace("G.T", "G.x"), ":6: 'x'; allowed: . G S @ O T W"),
        ("", ":1: the file ends before a line `map`"),
    ],
)
def test_a_bad_map_is_refused_with_file_line_and_what_is_allowed(write, text, said):
    with pytest.raises(FileError) as refused:
        read_map(write(text))

    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_scenario_has_start_and_goal_of_each_robot(write):
    grid = read_map(write(MAP))
    trips = read_scenario(write("version 1\n" + LINE, "scen"), grid)

    assert trips == (Trip(Cell(0, 0), Cell(2, 0)),)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ":1: ''; allowed: `version 1`"),
        (LINE, ":1: "),
        ("version 1\n0 room.map 3 2 0 0 2 0\n", ":2: 8 fields; allowed: nine: bucket, map"),
        ("version 1\n" + LINE.replace("\t2\t0\t4", "\t3\t0\t4"), ":2: goal x is '3'; allowed"),
        ("version 1\n" + LINE.replace("\t2\t0\t4", "\t-1\t0\t4"), ":2: goal x is '-1'; allowed"),
        ("version 1\n" + LINE.replace("\t2\t0\t4", "\t1\t0\t4"), ":2: the goal (1, 0) is blocked"),
    ],
)
def test_a_bad_scenario_is_refused_with_file_line_and_what_is_allowed(write, text, said):
    grid = read_map(write(MAP))

    with pytest.raises(FileError) as refused:
        read_scenario(write(text, "scen"), grid)

    assert said in str(refused.value)


def test_task_places_and_parking_are_numbers_of_free_cells(write):
    grid = read_map(write(MAP))
    places = read_task_places(write("s@e\n.sT\n", "pd"), grid)

    assert places.task.tolist() == [0, 3]
    assert places.parking.tolist() == [1]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("s@e\n", ":1: 1 rows of cells; allowed: 2"),
        ("sse\n..T\n", ":1: `s` in column 2 is where the map is blocked"),
        ("s@s\n..T\n", ": 2 places `s` and 0 places `e`; needed: two and one"),
        ("s@s\n.?T\n", ":2: '?'; allowed: s e ."),
    ],
)
def test_bad_task_places_are_refused(write, text, said):
    grid = read_map(write(MAP))

    with pytest.raises(FileError) as refused:
        read_task_places(write(text, "pd"), grid)

    assert said in str(refused.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileError, match=r"nothing\.map: cannot be read"):
        read_map(tmp_path / "nothing.map")


def test_a_file_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "file").write_bytes(np.arange(256, dtype=np.uint8).tobytes())

    with pytest.raises(FileError, match="is not a text file"):
        read_map(tmp_path / "file")
