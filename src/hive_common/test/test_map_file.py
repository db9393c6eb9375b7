# SPDX-License-Identifier: BSD-3-Clause
import math
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from shapely.geometry import Point, box

from hive_common.errors import FileError, MapError
from hive_common.grid_map import FREE, OCCUPIED, UNKNOWN, GridMap
from hive_common.map_file import load_map, load_turned_map, save_map
from hive_common.pose import Pose
from simenv.testing import hall
from simenv.world.draw_map import draw_map
from simenv.world.shapes import Shape
from simenv.world.world import World
from simenv.world.world_content import Place
from simenv.world.world_file import load_world

KEYS = {
    "image": "m.pgm",
    "resolution": "0.1",
    "origin": "[-1, -2, 0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


@pytest.mark.parametrize("odd", [math.nan, math.inf, -math.inf, 1e308, -1e308, 9.99])
def test_a_point_that_is_no_point_or_far_away_has_no_cell(odd):
    grid = GridMap(np.zeros((3, 4), dtype=np.int8), 0.05)

    assert grid.cell((odd, 0.1)) is None
    assert grid.cell((0.1, odd)) is None
    assert grid.cell((0.1, 0.12)) == (2, 2)


def write(folder: Path, pixels, **changes) -> str:
    """Write a map by hand; a change of None leaves the key out."""
    keys = KEYS | {"image": "m.png"} | changes
    PIL.Image.fromarray(np.array(pixels, dtype=np.uint8)).save(folder / "m.png")
    lines = [f"{key}: {value}" for key, value in keys.items() if value is not None]
    (folder / "m.yaml").write_text("\n".join(lines))
    return str(folder / "m.yaml")


def test_bright_cells_are_free_dark_ones_occupied_the_rest_unknown_top_row_first(tmp_path):
    grid = load_map(write(tmp_path, [[254, 0], [205, 254]]))

    assert grid.cells.tolist() == [[UNKNOWN, FREE], [FREE, OCCUPIED]]
    assert grid.resolution == 0.1
    assert grid.origin == (-1.0, -2.0, 0.0)


def test_a_negated_map_is_read_the_other_way_round(tmp_path):
    grid = load_map(write(tmp_path, [[254, 0], [100, 254]], negate="1"))

    assert grid.cells.tolist() == [[UNKNOWN, OCCUPIED], [OCCUPIED, FREE]]


def test_the_thresholds_decide(tmp_path):
    grid = load_map(write(tmp_path, [[120, 200]], occupied_thresh="0.5", free_thresh="0.25"))

    assert grid.cells.tolist() == [[OCCUPIED, FREE]]


def test_colours_and_opacity_are_averaged_as_map_server_does(tmp_path):
    # Brightness 60, 180, 165; with opacity averaged in 109, 199, 124.
    pixels = [[[30, 60, 90, 255], [180, 180, 180, 255], [250, 150, 95, 0]]]

    trinary = load_map(write(tmp_path, pixels, occupied_thresh="0.55", free_thresh="0.25"))
    scale = load_map(write(tmp_path, pixels, mode="scale", free_thresh="0.1"))
    opaque = load_map(
        write(tmp_path, np.array(pixels)[:, :, :3], occupied_thresh="0.55", free_thresh="0.3")
    )

    assert trinary.cells.tolist() == [[OCCUPIED, FREE, UNKNOWN]]
    assert scale.cells.tolist() == [[OCCUPIED, 35, UNKNOWN]]
    assert opaque.cells.tolist() == [[OCCUPIED, FREE, UNKNOWN]]


@pytest.mark.parametrize("kind", ["RGB", "P"])
@pytest.mark.parametrize(
    ("negate", "cells"), [("0", [UNKNOWN, FREE, OCCUPIED]), ("1", [OCCUPIED, OCCUPIED, UNKNOWN])]
)
def test_a_colour_counts_by_its_mean_and_not_by_how_bright_it_looks(tmp_path, kind, negate, cells):
    # Yellow, brightness 170 by its mean; white; blue, brightness 85.
    path = write(tmp_path, [[0]], negate=negate)
    pixels = np.array([[[255, 255, 0], [255, 255, 255], [0, 0, 255]]], dtype=np.uint8)
    PIL.Image.fromarray(pixels).convert(kind).save(tmp_path / "m.png")

    assert load_map(path).cells.tolist() == [cells]


def test_a_transparent_pixel_of_a_scaled_map_is_still_occupied_where_it_is_dark(tmp_path):
    grid = load_map(write(tmp_path, [[[0, 0, 0, 0], [255, 255, 255, 0]]], mode="scale"))

    assert grid.cells.tolist() == [[OCCUPIED, FREE]]


def test_raw_pixels_are_the_cells_as_signed_bytes_and_may_be_negated(tmp_path):
    pixels = [[0, 100, 127, 128, 255]]

    raw = load_map(write(tmp_path, pixels, mode="raw"))
    negated = load_map(write(tmp_path, pixels, mode="raw", negate="1"))

    assert raw.cells.tolist() == [[0, 100, 127, -128, -1]]
    assert negated.cells.tolist() == [[-1, -101, -128, 127, 0]]


@pytest.mark.parametrize(
    ("mode", "free", "between", "occupied"),
    [("trinary", 26, {UNKNOWN}, 90), ("scale", 26, set(range(1, 100)), 90)],
)
def test_all_shades_of_grey_are_split_by_the_thresholds(tmp_path, mode, free, between, occupied):
    shades = np.arange(256).reshape(16, 16)

    cells = load_map(write(tmp_path, shades, mode=mode, free_thresh="0.1")).cells

    assert (cells == FREE).sum() == free
    assert (cells == OCCUPIED).sum() == occupied
    assert set(cells[(cells != FREE) & (cells != OCCUPIED)].tolist()) <= between


@pytest.mark.parametrize("kind", ["png", "bmp", "pgm"])
def test_an_image_of_any_usual_format_is_read(tmp_path, kind):
    path = write(tmp_path, [[0]], image=f"m.{kind}")
    pixels = np.array([[254, 0, 205], [0, 254, 254]], dtype=np.uint8)
    PIL.Image.fromarray(pixels).save(tmp_path / f"m.{kind}")

    assert load_map(path).cells.tolist() == [[OCCUPIED, FREE, FREE], [FREE, OCCUPIED, UNKNOWN]]


def test_a_key_that_map_server_does_not_know_is_warned_of_and_ignored(tmp_path):
    said = []

    grid = load_map(write(tmp_path, [[254]], colour="red"), said.append)

    assert grid.cells.tolist() == [[FREE]]
    assert len(said) == 1
    assert ":7: colour: unknown, and ignored; known are image, " in said[0]


def test_a_saved_map_is_read_back_as_it_was(tmp_path):
    random = np.random.default_rng(1)
    cells = random.choice([FREE, OCCUPIED, UNKNOWN], (30, 20)).astype(np.int8)
    grid = GridMap(cells, 0.05, Pose(-1.5, 2.25))

    save_map(grid, tmp_path / "saved")

    again = load_map(str(tmp_path / "saved.yaml"))
    assert (again.cells == cells).all()
    assert (again.resolution, again.origin) == (0.05, grid.origin)


@pytest.mark.parametrize("yaw", ["0.0", "6.283185", "-0.00001"])
def test_a_map_that_is_turned_by_nothing_or_by_a_rounding_error_is_read(tmp_path, yaw):
    assert load_map(write(tmp_path, [[0]], origin=f"[1, 2, {yaw}]")).bounds == (1.0, 2.0, 1.1, 2.1)


def test_a_map_that_is_turned_is_read_upright_and_for_passing_it_on_as_it_is(tmp_path):
    path = write(tmp_path, [[254, 0, 254], [205, 254, 254]], origin=f"[1, 2, {math.pi / 2}]")

    as_it_is, upright = load_turned_map(path), load_map(path)

    assert as_it_is.cells.tolist() == [[UNKNOWN, FREE, FREE], [FREE, OCCUPIED, FREE]]
    assert as_it_is.origin == (1.0, 2.0, math.pi / 2)
    assert upright.cells.tolist() == [[FREE, UNKNOWN], [OCCUPIED, FREE], [FREE, FREE]]
    assert upright.origin == pytest.approx((0.8, 2.0, 0.0))


def test_a_map_that_would_be_too_large_when_it_is_turned_is_refused_with_its_file(tmp_path):
    path = write(tmp_path, np.zeros((100, 12_000)), origin="[0, 0, 0.785]")

    with pytest.raises(MapError, match=r"m\.yaml: the map is turned by 0\.785 rad") as caught:
        load_map(path)
    assert "\n" not in str(caught.value)


def test_a_grid_that_is_turned_cannot_be_made():
    with pytest.raises(
        MapError, match=r"origin has a yaw of -1\.5 rad; allowed: 0; make it upright first"
    ):
        GridMap(np.zeros((2, 2), dtype=np.int8), 0.05, Pose(0.0, 0.0, -1.5))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"image": "other.pgm"}, "other.pgm: cannot be read: No such file"),
        ({"image": "m.yaml"}, "is not a readable image"),
        ({"image": None}, ":1: image: missing; allowed: the name of an image file"),
        ({"image": '"m\\0.png"'}, "cannot be read"),
        ({"resolution": "50"}, r":2: resolution.*at most 10"),
        ({"resolution": "0"}, r":2: resolution.*above 0"),
        ({"resolution": "fine"}, ":2: resolution: 'fine'; allowed: the size of a cell"),
        ({"resolution": ".nan"}, "finite"),
        ({"origin": "[0, 0]"}, "lower left corner"),
        ({"origin": "[0, .inf, 0]"}, "finite"),
        ({"origin": "[0, 0, 1001]"}, "turned by at most 1000 rad"),
        ({"negate": "2"}, "0, or 1 if white means occupied"),
        ({"mode": "odd"}, "trinary"),
        ({"free_thresh": "0.9"}, ":6: free_thresh: 0.9 is not below occupied_thresh 0.65"),
    ],
)
def test_a_bad_map_gives_one_line_that_says_what_is_allowed(tmp_path, changes, words):
    path = write(tmp_path, [[0]], **changes)

    with pytest.raises((FileError, MapError), match=words) as caught:
        load_map(path)

    assert "\n" not in str(caught.value)


def test_an_image_that_is_cut_off_is_refused(tmp_path):
    path = write(tmp_path, np.zeros((50, 50)))
    image = tmp_path / "m.png"
    image.write_bytes(image.read_bytes()[:-30])

    with pytest.raises(MapError, match="cut off or damaged"):
        load_map(path)


def test_a_pgm_that_is_cut_off_is_refused(tmp_path):
    path = write(tmp_path, [[0]], image="m.pgm")
    (tmp_path / "m.pgm").write_bytes(b"P5\n40 40\n255\nabc")

    with pytest.raises(MapError, match="cut off or damaged"):
        load_map(path)


def test_an_image_without_pixels_or_with_too_many_bits_is_refused(tmp_path):
    path = write(tmp_path, [[0]])
    (tmp_path / "m.png").write_bytes(b"")
    with pytest.raises(MapError, match="is not a readable image"):
        load_map(path)
    PIL.Image.fromarray(np.full((2, 2), 30000, dtype=np.uint16)).save(tmp_path / "m.png")
    with pytest.raises(MapError, match="more than 8 bits"):
        load_map(path)


@pytest.mark.parametrize("text", ["", "# nothing\n", "image: m.png\nimage: n.png\n"])
def test_a_map_that_says_nothing_or_something_twice_is_refused(tmp_path, text):
    path = tmp_path / "m.yaml"
    path.write_text(text)

    with pytest.raises(FileError, match=r"is empty|:2: the key image appears twice"):
        load_map(str(path))


def test_a_missing_map_names_those_that_are_there():
    with pytest.raises(FileError, match="map 'moon': not known; allowed: lab, warehouse"):
        load_map("moon")
    with pytest.raises(FileError, match="/nowhere/moon: cannot be read"):
        load_map("/nowhere/moon")


def test_a_map_that_cannot_be_written_says_so(tmp_path):
    grid = GridMap(np.zeros((2, 2), dtype=np.int8), 0.05, Pose(0, 0, 0))

    with pytest.raises(MapError, match="cannot be written"):
        save_map(grid, tmp_path / "nowhere" / "map")
    for folder in (".", "..", "/"):
        with pytest.raises(MapError, match="is a folder"):
            save_map(grid, Path(folder))


def test_cells_that_something_reaches_into_are_occupied_and_those_beside_it_are_free():
    grid = draw_map(hall(Shape("table", box(2.0, 3.0, 2.52, 3.2))), 0.05)

    assert grid.cells.shape == (200, 200)
    assert (grid.cells[60:64, 40:51] == OCCUPIED).all()
    frame = grid.cells[59:65, 39:52].copy()
    frame[1:-1, 1:-1] = FREE
    assert (frame == FREE).all()


def test_a_drawn_map_agrees_with_the_world_cell_by_cell():
    pillar = Shape("pillar", Point(4.0, 4.0).buffer(0.7, 8))
    world = hall(pillar)
    grid = draw_map(world, 0.1)

    for row in range(30, 50):
        for column in range(30, 50):
            cell = box(column / 10, row / 10, (column + 1) / 10, (row + 1) / 10)
            if cell.distance(pillar.area) > 0.01:
                assert grid.cells[row, column] == FREE
            elif cell.intersection(pillar.area).area > 1e-4:
                assert grid.cells[row, column] == OCCUPIED


def test_what_is_closed_off_is_unknown():
    office = Shape("office", box(6.0, 6.0, 8.0, 8.0).difference(box(6.2, 6.2, 7.8, 7.8)))
    walls = hall(office)
    world = World("w", walls.size, walls.shapes, starts=(Place("start", Pose(2.0, 2.0, 0.0)),))

    grid = draw_map(world, 0.1)

    assert (grid.cells[62:78, 62:78] == UNKNOWN).all()
    assert grid.cells[20, 20] == FREE


@pytest.mark.parametrize("resolution", [0.0, -1.0, float("nan"), float("inf"), 20.0, 1e-6])
def test_a_resolution_that_gives_no_map_is_refused(resolution):
    with pytest.raises(MapError, match="resolution"):
        draw_map(hall(), resolution)


@pytest.mark.parametrize("name", ["lab", "warehouse"])
def test_the_maps_of_this_package_are_what_its_worlds_look_like(name):
    drawn, stored = draw_map(load_world(name)), load_map(name)

    assert (drawn.cells == stored.cells).all(), "draw it again: rosrun simenv draw_map"
    assert (drawn.resolution, drawn.origin) == (stored.resolution, stored.origin)


def test_in_scale_mode_shades_say_how_occupied_a_cell_is(tmp_path):
    grid = load_map(write(tmp_path, [[254, 180, 120, 0]], mode="scale"))

    assert grid.cells[0, 0] == FREE
    assert grid.cells[0, 3] == OCCUPIED
    assert 1 <= grid.cells[0, 1] < grid.cells[0, 2] <= 99


def test_a_map_can_be_saved_as_png(tmp_path):
    cells = np.array([[FREE, OCCUPIED, UNKNOWN]], dtype=np.int8)
    save_map(GridMap(cells, 0.05, Pose(0.0, 0.0, 0.0)), tmp_path / "saved", kind="png")

    assert (tmp_path / "saved.png").read_bytes().startswith(b"\x89PNG")
    assert (load_map(str(tmp_path / "saved.yaml")).cells == cells).all()


def test_a_huge_map_is_refused_before_it_fills_the_memory(tmp_path):
    name = write(tmp_path, [[0]])
    PIL.Image.new("L", (8000, 8000)).save(tmp_path / "m.png")

    with pytest.raises(MapError, match="8000 x 8000 cells are more than 25,000,000") as caught:
        load_map(name)
    assert "\n" not in str(caught.value)


def test_a_huge_world_or_too_fine_a_resolution_is_refused():
    world = World("huge", (400.0, 400.0), ())

    with pytest.raises(MapError, match="8000 x 8000 cells"):
        draw_map(world, 0.05)
