# SPDX-License-Identifier: BSD-3-Clause
import textwrap

import pytest
from shapely.geometry import Point

from hive_common.errors import FileError
from robot_description.models import load_model, model_names
from simenv.noise import NO_NOISE
from simenv.simulation import Simulation
from simenv.world.world_file import load_world, world_mistakes

WORLDS = ("lab", "warehouse")


def read(tmp_path, text):
    path = tmp_path / "world.yaml"
    path.write_text(textwrap.dedent(text))
    return load_world(str(path))


def small(extra=""):
    return f"name: small\nsize: [4.0, 4.0]\nwalls: []\n{extra}"


@pytest.mark.parametrize(
    ("form", "inside", "outside"),
    [
        ("box: [1, 1, 2, 3]", (1.9, 2.9), (2.1, 2.9)),
        ("polygon: [[1, 1], [3, 1], [1, 3]]", (1.9, 1.9), (2.1, 2.1)),
        ("circle: {centre: [2, 2], radius: 1}", (2.9, 2.0), (2.8, 2.8)),
        ("segment: {from: [1, 2], to: [3, 2], thickness: 0.4}", (3.0, 2.19), (2.0, 2.21)),
    ],
)
def test_every_form_of_shape_covers_what_it_says(tmp_path, form, inside, outside):
    world = read(tmp_path, small(f"racks:\n  - {{name: thing, {form}}}\n"))

    assert world.solid_at(Point(inside)) == "thing"
    assert world.solid_at(Point(outside)) is None


def test_shapes_that_overlap_become_one_outline(tmp_path):
    world = read(
        tmp_path,
        small("racks:\n  - {name: a, box: [1, 1, 2, 2]}\n  - {name: b, box: [2, 1, 3, 2]}\n"),
    )

    assert world.solid.area == pytest.approx(2.0)
    assert abs(world.segments[:, 0] - world.segments[:, 1]).sum() == pytest.approx(6.0)


def test_stations_chargers_and_starts_are_read(tmp_path):
    world = read(
        tmp_path,
        small("""\
stations:
  - {name: shelf, pose: [1, 2, 3], item: bolts, stock: 4, duration: 5}
  - {name: bench, pose: [1, 3, 0]}
chargers: [{name: socket, pose: [1, 1, 0]}]
starts: [{name: corner, pose: [2, 2, 0]}]
"""),
    )

    shelf, bench = world.stations
    assert (shelf.pose, shelf.item, shelf.stock, shelf.duration) == ((1, 2, 3), "bolts", 4, 5)
    assert (bench.item, bench.stock, bench.duration) == ("", None, None)
    assert [place.name for place in (*world.chargers, *world.starts)] == ["socket", "corner"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("just a text", "the whole file"),
        ("name: [", "is not YAML"),
        ("name: &name [*name]", "an alias .* is inside its own anchor"),
        (small("walls: []"), ":.*the key walls appears twice"),
        (
            "name: a\nsize: [8000, 8000]\nwalls: []",
            r":2: size\[0\]: 8000; allowed: a length .* at most 500",
        ),
        (small("trees: []"), r":4: trees: unknown; allowed: the keys name, size"),
        ("name: a\nsize: [4.0, x]\nwalls: []", r":2: size\[1\]: 'x'; allowed: a length"),
        ("name: a\nsize: [4.0, -1]\nwalls: []", r":2: size\[1\].*above 0"),
        ("name: a\nsize: [.nan, 4.0]\nwalls: []", "finite"),
        (small("racks: [{name: a}]"), "exactly one of box"),
        (small("racks: [{name: a, bocks: [1, 1, 2, 2]}]"), r"racks\[0\].bocks: unknown.*box"),
        (small("racks: [{name: a, box: [1, 1, 2]}]"), "y_max"),
        (small("racks: [{name: a, box: [2, 2, 1, 1]}]"), r"racks\[0\].box: \[2.0.* is empty"),
        (small("racks: [{name: a, box: [1, 1, .nan, 2]}]"), "finite"),
        (small("racks: [{name: a, box: [1, 1, 5, 2]}]"), r"'a' reaches .* outside the building"),
        (small("racks: [{name: a, circle: {centre: [1, 1], radius: 0}}]"), "above 0"),
        (
            small("racks: [{name: a, segment: {from: [1, 1], to: [1, 1], thickness: 0.1}}]"),
            "starts and ends",
        ),
        (
            small("racks: [{name: a, polygon: [[1, 1], [2, 2], [2, 1], [1, 2]]}]"),
            r"racks\[0\].polygon: its edges cross",
        ),
        (
            small("chargers: [{name: a, pose: [1, 1, 0]}, {name: a, pose: [2, 1, 0]}]"),
            "name 'a' is used twice",
        ),
        (
            small(
                "racks: [{name: b, box: [1, 1, 2, 2]}]\nstarts: [{name: a, pose: [1.5, 1.5, 0]}]"
            ),
            "'a' at .* is inside 'b'",
        ),
        (small("stations: [{name: a, pose: [1, 1, .nan]}]"), "finite"),
        (small("stations: [{name: a, pose: [1, 1, 0], stock: -1}]"), "0..1e\\+06"),
        (small("stations: [{name: a, pose: [1, 1, 0], duration: .nan}]"), "finite"),
    ],
)
def test_a_bad_world_gives_one_line_that_says_where_and_what_is_allowed(tmp_path, text, words):
    with pytest.raises(FileError, match=words) as caught:
        read(tmp_path, text)

    assert str(tmp_path / "world.yaml") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_missing_world_names_those_that_are_there():
    with pytest.raises(FileError, match="world 'moon': not known; allowed: lab, warehouse"):
        load_world("moon")
    with pytest.raises(FileError, match="/nowhere/moon: cannot be read"):
        load_world("/nowhere/moon")


@pytest.mark.parametrize("name", WORLDS)
def test_every_model_finds_room_at_every_place_of_the_worlds(name):
    simulation = Simulation(load_world(name), noise=NO_NOISE)
    world = simulation.world
    for model in map(load_model, model_names()):
        for place in (*world.stations, *world.chargers, *world.starts):
            simulation.add_robot("robot1", model, place.pose)
            assert simulation.poses["robot1"] == place.pose
            simulation.remove_robot("robot1")


@pytest.mark.parametrize(("name", "width", "depth"), [("lab", 20, 12), ("warehouse", 60, 40)])
def test_the_worlds_have_the_promised_size_and_places(name, width, depth):
    world = load_world(name)

    assert world.size == (width, depth)
    assert len(world.stations) >= 4
    assert len(world.chargers) >= 4
    assert len(world.starts) >= 4


@pytest.mark.parametrize("name", WORLDS)
def test_four_robots_can_start_together(name):
    world = load_world(name)
    simulation = Simulation(world)
    for index, place in enumerate(world.starts[:4]):
        simulation.add_robot(f"robot{index + 1}", load_model("mir100"), place.pose)

    assert len(simulation.names) == 4


def test_doors_parking_and_people_are_read(tmp_path):
    world = read(
        tmp_path,
        small("""\
doors:
  - {name: gate, box: [1, 1, 2, 1.1], open: false, height: 2}
  - {name: hatch, segment: {from: [3, 1], to: [3, 2], thickness: 0.1}}
parking: [{name: bay, pose: [2, 2, 0]}]
people: [{name: ann, route: [[1, 3], [3, 3]], speed: 1.2, radius: 0.3}]
"""),
    )

    gate, hatch = world.doors
    assert (gate.open, gate.height, hatch.open) == (False, 2, True)
    assert [place.name for place in world.places] == ["bay"]
    assert world.people[0].route == ((1.0, 3.0), (3.0, 3.0))
    assert world.solid_at(Point(1.5, 1.05)) is None


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ("people: [{name: ann, route: [[1, 1]]}]", ":4: people.*at least 2 points"),
        ("people: [{name: ann, route: [[1, 1], [1, 1]]}]", ":4: people.*has no length"),
        (
            (
                "racks: [{name: b, box: [1, 1, 2, 2]}]\n"
                "people: [{name: ann, route: [[1.5, 0.5], [1.5, 3]]}]"
            ),
            ":5: people.*runs into 'b'",
        ),
        ("people: [{name: ann, route: [[0.1, 1], [3, 1]]}]", ":4: .*outside the building"),
        ("doors: [{name: gate, box: [1, 1, 2, 2], circle: {centre: [1, 1], radius: 1}}]", ":4: "),
        ("doors: [{name: gate}]", ":4: doors.*exactly one of box"),
        ("parking: [{name: bay, pose: [9, 9, 0]}]", ":4: .*outside the building"),
    ],
)
def test_mistakes_with_doors_and_people_have_their_line(tmp_path, extra, words):
    with pytest.raises(FileError, match=words):
        read(tmp_path, small(extra))


def test_every_mistake_of_a_world_is_named_with_its_line(tmp_path):
    path = tmp_path / "world.yaml"
    path.write_text(
        "name: bad\nsize: [4.0, -4.0]\nwalls:\n  - {name: a, box: [1, 1, 2]}\ntrees: []\n"
    )

    lines = [str(mistake).removeprefix(f"{path}:") for mistake in world_mistakes(str(path))]

    assert [line.split(":")[0] for line in lines] == ["2", "4", "5"]


def test_an_unknown_key_in_a_shape_is_one_mistake(tmp_path):
    path = tmp_path / "world.yaml"
    path.write_text(small("racks: [{name: a, bocks: [1, 1, 2, 2]}]"))

    (mistake,) = world_mistakes(str(path))

    assert "racks[0].bocks: unknown" in str(mistake)


def test_contradictions_are_all_named_too(tmp_path):
    path = tmp_path / "world.yaml"
    path.write_text(
        "name: bad\n"
        "size: [4.0, 4.0]\n"
        "walls:\n"
        "  - {name: a, box: [1, 1, 2, 2]}\n"
        "starts:\n"
        "  - {name: s, pose: [1.5, 1.5, 0]}\n"
        "  - {name: a, pose: [9, 9, 0]}\n"
    )

    lines = [str(mistake).removeprefix(f"{path}:") for mistake in world_mistakes(str(path))]

    assert [line.split(":")[0] for line in lines] == ["7", "6", "7"]
    assert "inside 'a'" in lines[1]


def test_a_world_without_mistakes_has_none():
    assert world_mistakes("lab") == []
