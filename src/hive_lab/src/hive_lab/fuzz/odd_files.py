# SPDX-License-Identifier: BSD-3-Clause
"""Changes single values of the files that come with the packages, and reads them as users would.

A reader either takes such a file, and then everything that is made of it must work too, or it
refuses it with an error of ours that names the file.
"""

from __future__ import annotations

import copy
import math
import shutil
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

import yaml

from fleet_manager.config.fleet_check import building_mistakes
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.fleet_launch import launch_text
from fleet_manager.config.scenario import read_scenario
from hive_common.errors import HiveError
from hive_common.map_file import load_map
from hive_common.resources import package_folder
from hive_lab.compare.experiment import read_experiment
from robot_description.joints import fixed_joints
from robot_description.models import load_model
from robot_description.urdf import robot_urdf
from simenv.simulation import Simulation
from simenv.world.world_file import load_world
from vda5050.agent.maker import read_maker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

_ODD: tuple[Any, ...] = (
    *(
        math.nan,
        math.inf,
        -math.inf,
        1e308,
        -1e308,
        5e-324,
        -1.0,
        -0.0,
        0,
        1,
        2**31,
        10**20,
        10**400,
    ),
    *("", " ", "x" * 5000, "\x1b[31m", "../..", "/", "1", "nan", "Zürich", "a b", "~", "0x10"),
    *(None, True, [], {}, [[]], {"x": 1}, [0.0] * 3, ["a"] * 300, {1: 2}, "2021-01-01"),
)

_LARGE = 1e300
_DAMAGED = 0.2  # share of the files whose text is damaged

_BYTES = (b"\x00", b"\xff", b"\t", b"\n", b":", b"-", b"{", b"&a ", b"*a ", b"'", b"%", b"9" * 400)


@dataclass(frozen=True)
class Reader:
    """One kind of file.

    Attributes:
        folder: Where those that come with a package are: the package, and a folder in it.
        read: Reads the file of a path, and uses what it has read.
    """

    folder: tuple[str, str]
    read: Callable[[Path], object]


def _use_model(path: Path) -> None:
    load_model(path)
    fixed_joints(robot_urdf(path, "robot1/"))


def _use_fleet(path: Path) -> None:
    fleet = read_fleet(str(path))
    launch_text(fleet, sim=True, port=lambda: 1)
    launch_text(fleet, sim=False, port=lambda: 1)
    list(building_mistakes(fleet, load_world("lab"), load_map("lab")))


def _use_world(path: Path) -> None:
    simulation = Simulation(load_world(str(path)), seed=1)
    for _ in range(3):
        simulation.step()


READERS = {
    "robot model": Reader(("robot_description", "models"), _use_model),
    "fleet": Reader(("fleet_manager", "fleets"), _use_fleet),
    "scenario": Reader(("fleet_manager", "scenarios"), lambda path: read_scenario(str(path))),
    "experiment": Reader(
        ("fleet_manager", "experiments"), lambda path: read_experiment(str(path))
    ),
    "world": Reader(("simenv", "worlds"), _use_world),
    "map": Reader(("simenv", "maps"), lambda path: load_map(str(path))),
    "maker": Reader(("vda5050", "makers"), lambda path: read_maker(str(path))),
}


@dataclass
class Found:
    """What became of odd files.

    Attributes:
        refused: How many were refused.
        taken: How many were taken.
        failures: What went wrong, in words.
    """

    refused: int = 0
    taken: int = 0
    failures: list[str] = field(default_factory=list)


def fuzz_files(kind: str, seed: int, files: int) -> Found:
    """Read odd files of a kind.

    Args:
        kind: One of `READERS`.
        seed: The same seed gives the same files.
        files: How many.
    """
    reader, random, found = READERS[kind], Random(seed), Found()
    package, name = reader.folder
    with tempfile.TemporaryDirectory() as place:
        # With the images that maps name.
        folder = shutil.copytree(package_folder(package) / name, Path(place) / name)
        originals = sorted(folder.glob("*.yaml"))
        for _ in range(files):
            original = random.choice(originals)
            data, what = _changed(original.read_bytes(), random)
            file = folder / "odd.yaml"
            file.write_bytes(data)
            _read(reader, file, f"{original.name}, {what}", found)
    return found


def _read(reader: Reader, file: Path, what: str, found: Found) -> None:
    """Read an odd file, and note what became of it."""
    try:
        reader.read(file)
    except HiveError as error:
        found.refused += 1
        if str(file.parent) not in str(error):
            found.failures.append(f"{what}: names no file: {error}")
    except Exception as error:  # noqa: BLE001  (whatever it is, a user would see a traceback)
        found.failures.append(f"{what}: {type(error).__name__}: {error}")
    else:
        found.taken += 1


def _changed(data: bytes, random: Random) -> tuple[bytes, str]:
    """Return a file with something odd in it, and what."""
    if random.random() < _DAMAGED:
        return damaged(data, random)
    tree = yaml.safe_load(data)
    changes = [change(tree, random) for _ in range(random.choice((1, 1, 1, 2, 3)))]
    return yaml.safe_dump(tree, sort_keys=False, allow_unicode=True).encode(), ", ".join(changes)


def change(tree: Any, random: Random) -> str:  # noqa: ANN401  (what YAML holds)
    """Change one value of a tree in place, and return what was changed."""
    places = list(_places(tree))
    holder, key = random.choice(places)
    deed = random.choice(("remove", "rename", *["replace"] * 8))
    if deed == "remove":
        del holder[key]
        return f"without {key!r:.40}"
    if deed == "rename" and isinstance(holder, dict):
        holder[f"{key}_"] = holder.pop(key)
        return f"{key!r:.40} called otherwise"
    other_holder, other_key = random.choice(places)
    odd = random.choice((*_ODD, *_near(holder[key]), other_holder[other_key]))
    holder[key] = copy.deepcopy(odd)
    return f"{key!r:.40} = {odd!r:.60}"


def damaged(data: bytes, random: Random) -> tuple[bytes, str]:
    """Return a file whose text is damaged at one place, and how."""
    at = random.randrange(len(data))
    if random.choice((True, False)):
        return data[:at], f"cut off after {at} bytes"
    odd = random.choice(_BYTES)
    return data[:at] + odd + data[at + random.choice((0, 1, 5)) :], f"{odd[:10]!r} at byte {at}"


def _near(value: Any) -> tuple[Any, ...]:  # noqa: ANN401  (what YAML holds)
    """Return odd values that are close to a good one."""
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > _LARGE:
        return ([value], str(value))
    return (-value, value * 1000, value / 1000, value + 1, str(value), [value])


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:  # noqa: ANN401  (what YAML holds)
    """Yield every place of a tree: what holds it, and its key or index."""
    keys: list[Any] = []
    if isinstance(tree, dict):
        keys = list(tree)
    elif isinstance(tree, list):
        keys = list(range(len(tree)))
    for key in keys:
        yield tree, key
        yield from _places(tree[key])
