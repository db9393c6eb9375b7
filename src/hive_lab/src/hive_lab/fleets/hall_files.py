# SPDX-License-Identifier: BSD-3-Clause
"""Writes world, map and fleet file of a hall with eight racks, for any number of robots."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import yaml

from hive_common.map_file import save_map
from simenv.world.draw_map import draw_map
from simenv.world.world_file import load_world

if TYPE_CHECKING:
    from pathlib import Path

WIDTH, DEPTH = 42.0, 25.0  # [m]
MODELS = ("mir100", "ld60", "youbot", "fetch")

_WALL = 0.2  # thickness [m]
_RACKS = [(x, y, x + 6.0, y + 1.0) for y in (8.0, 16.0) for x in (4.0, 13.0, 23.0, 32.0)]
_BESIDE = 1.5  # distance of a station from its rack [m]
_APART = 2.0  # distance of two starts [m]
_START_ROWS = (2.0, 4.0, 21.0, 23.0)  # their y [m]


class HallFiles(NamedTuple):
    """Paths of the files, as `fleet_manager.launch` takes them."""

    world: str
    map: str
    fleet: str


def write_hall(folder: Path, robots: int) -> HallFiles:
    """Write the files of a hall with robots of all models, named `robot1` and so on.

    Raises:
        ValueError: There are more robots than starts.
    """
    world, fleet = folder / "hall.yaml", folder / "fleet.yaml"
    world.write_text(yaml.safe_dump(_world()), encoding="utf-8")
    save_map(draw_map(load_world(str(world))), folder / "hall_map")
    fleet.write_text(yaml.safe_dump({"cost_model": "time", "robots": _robots(robots)}))
    return HallFiles(str(world), str(folder / "hall_map.yaml"), str(fleet))


def _world() -> dict[str, object]:
    inner_x, inner_y = WIDTH - _WALL, DEPTH - _WALL
    walls = {
        "south": [0.0, 0.0, WIDTH, _WALL],
        "north": [0.0, inner_y, WIDTH, DEPTH],
        "west": [0.0, _WALL, _WALL, inner_y],
        "east": [inner_x, _WALL, WIDTH, inner_y],
    }
    stations = [
        {"name": f"rack {number} {side}", "pose": [(left + right) / 2 + shift, y, 0.0]}
        for number, (left, low, right, high) in enumerate(_RACKS, start=1)
        for side, y, shift in (("south", low - _BESIDE, -2.0), ("north", high + _BESIDE, 2.0))
    ]
    return {
        "name": "hall",
        "size": [WIDTH, DEPTH],
        "walls": [{"name": f"{name} wall", "box": box} for name, box in walls.items()],
        "racks": [
            {"name": f"rack {number}", "box": list(box)}
            for number, box in enumerate(_RACKS, start=1)
        ],
        "stations": stations,
    }


def _robots(number: int) -> list[dict[str, object]]:
    places = [
        (_APART * (1 + column), y)
        for column, y in itertools.product(range(int(WIDTH / _APART) - 1), _START_ROWS)
    ]
    if number > len(places):
        raise ValueError(f"{number} robots; the hall has room for {len(places)} at the start")
    return [
        {"name": f"robot{index + 1}", "model": MODELS[index % len(MODELS)], "pose": [x, y, 0.0]}
        for index, (x, y) in enumerate(places[:number])
    ]
