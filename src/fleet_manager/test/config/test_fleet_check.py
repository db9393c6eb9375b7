# SPDX-License-Identifier: BSD-3-Clause
"""What of a fleet does not fit the building is named before anything starts."""

import numpy as np
import pytest

from fleet_manager.config.fleet_check import building_mistakes
from fleet_manager.config.fleet_file import read_fleet, read_fleet_and_mistakes
from hive_common.grid_map import GridMap
from hive_common.map_file import load_map
from simenv.world.world_file import load_world

FLEET = """\
{more}
robots:
  - {{name: amy, model: mir100, pose: {pose}}}
  - {{name: bob, model: ld60, pose: [5.0, 6.0, 0]}}
"""
FREE = "[4.0, 4.0, 0]"


@pytest.fixture
def found(tmp_path):
    """Return the mistakes of a fleet against the lab's world and map, without the folder."""

    def check(pose=FREE, more="", world="lab", chart="lab"):
        path = tmp_path / "mine.yaml"
        path.write_text(FLEET.format(pose=pose, more=more), encoding="utf-8")
        fleet, mistakes = read_fleet_and_mistakes(str(path))
        mistakes += building_mistakes(
            fleet,
            load_world(world) if world else None,
            load_map(chart) if isinstance(chart, str) else chart,
        )
        return [str(each).replace(f"{tmp_path}/", "") for each in mistakes]

    return check


@pytest.mark.parametrize("name", ["lab", "mixed", "warehouse"])
def test_the_fleets_that_come_along_fit_their_buildings(name):
    place = "warehouse" if name == "warehouse" else "lab"

    assert not list(building_mistakes(read_fleet(name), load_world(place), load_map(place)))
    assert not list(building_mistakes(read_fleet(name), None, load_map(place)))


@pytest.mark.parametrize("world", ["lab", None])
@pytest.mark.parametrize(
    ("pose", "in_world", "on_map"),
    [
        ("[100, 100, 0]", "outside the world 'lab', which reaches from (0, 0) to (20, 12) m",
         "outside the map, which reaches from (0.00, 0.00) to (20.00, 12.00) m"),
        ("[10.0, 6.0, 0]", "'middle wall centre' is there", "inside a wall"),
        ("[13.0, 4.8, 0]", "'pillar' is there", "the map is occupied at"),
    ],
)  # fmt: skip
def test_a_start_that_cannot_be_is_named_with_what_is_there(found, world, pose, in_world, on_map):
    said = found(pose=pose, world=world)

    assert len(said) == 1
    assert said[0].startswith("mine.yaml:3: robots[0].pose: amy cannot start at (")
    assert (in_world if world else on_map) in said[0]


def test_robots_whose_bases_overlap_are_named(found):
    said = found(pose="[5.3, 6.0, 1.57]")

    assert len(said) == 1
    assert "mine.yaml:4: robots[1].pose: bob starts at" in said[0]
    assert "0.30 m from amy: their bases overlap" in said[0]


def test_every_mistake_is_named_not_only_the_first(found):
    more = (
        "chargers: [{name: dock, pose: [-3, 1, 0]}, {name: wall, pose: [10, 6, 0]}]\n"
        "zones: [{name: far, kind: keep-out, corners: [[30, 1], [31, 1], [31, 2]]}]"
    )

    said = found(pose="[100, 100, 0]", more=more)

    keys = [line.split(": ")[1] for line in said]
    assert keys == ["robots[0].pose", "chargers[0].pose", "chargers[1].pose", "zones[0].corners"]
    assert all("\n" not in line for line in said)


def test_a_model_that_is_missing_hides_no_other_mistake(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(
        "robots:\n"
        "  - {name: amy, model: nothing, pose: [4.0, 4.0, 0]}\n"
        "  - {name: bob, model: ld60, pose: [100, 100, 0]}\n"
    )

    fleet, mistakes = read_fleet_and_mistakes(str(path))
    mistakes += building_mistakes(fleet, load_world("lab"), load_map("lab"))

    keys = [str(each).split(": ")[1] for each in mistakes]
    assert keys == ["robots[0].model", "robots[1].pose"]


@pytest.mark.parametrize("world", ["lab", None])
def test_an_agv_that_is_not_simulated_is_looked_for_on_the_map_only(tmp_path, world):
    path = tmp_path / "mine.yaml"
    path.write_text("robots: [{name: agv, driver: vda5050, pose: [10.0, 6.0, 0]}]\n")

    said = list(
        building_mistakes(
            read_fleet(str(path)), load_world(world) if world else None, load_map("lab")
        )
    )

    assert len(said) == 1
    assert "inside a wall" in str(said[0])


@pytest.mark.parametrize(("x", "is_good"), [(1.29, True), (1.26, True), (1.1, False)])
def test_a_robot_beside_a_wall_is_not_refused_for_the_rounding_of_the_map(found, x, is_good):
    blocked = np.zeros((200, 200), dtype=bool)
    blocked[:, :20] = True  # a wall up to x = 1 m; a mir100 needs 0.29 m

    said = found(pose=f"[{x}, 4.0, 0]", world=None, chart=GridMap.of_blocked(blocked, 0.05))

    assert (said == []) is is_good


@pytest.mark.parametrize(("width", "is_good"), [(9.0, True), (7.0, False)])
def test_a_zone_beside_the_map_is_refused_with_where_the_map_is(found, width, is_good):
    chart = GridMap.of_blocked(np.zeros((100, round(width * 10)), dtype=bool), 0.1)
    more = "zones: [{name: far, kind: keep-out, corners: [[8, 1], [8.5, 1], [8.5, 2]]}]"

    said = found(more=more, world=None, chart=chart)

    assert (said == []) is is_good
    assert (
        is_good
        or "zones[0].corners: x 8..8.5, y 1..2 [m] is beside the map; allowed: x 0..7" in said[0]
    )
