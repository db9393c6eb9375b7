# SPDX-License-Identifier: BSD-3-Clause
"""Reads fleet files: which robots there are, where they start, and how the hive decides.

The files in `fleets/` are the manual of the format. A mistake costs an operator the time between
starting a fleet and seeing that it is not there, so everything that can be known beforehand is
checked here, and said in one line with file, line and key.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from math import dist
from typing import TYPE_CHECKING, Any

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.settings import DECISIONS, DISTANCES, STANDING_BY, ChargingSettings
from blackboard.errors import SettingsError
from hive_common.checked_yaml import error_at, read_checked
from hive_common.errors import FileError
from hive_common.resources import beside, find_file
from robot_description.models import load_model

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from robot_description.models import RobotModel

LOCALIZATIONS = ("fake_localization", "amcl", "none")

TAKEN_NAMES = frozenset({
    "blackboard", "simenv", "fleet_manager", "launch_fleet", "map_server", "rviz", "hive",
    "task_markers", "task_entry", "task_view", "rosout", "map", "odom", "clock", "tf",
})  # fmt: skip
"""Names that nodes, topics or frames of the hive have already; no robot may have them."""

_POSE = {
    "type": "array",
    "minItems": 3,
    "maxItems": 3,
    "items": {"type": "number", "description": "a number [m, m, rad]"},
    "description": "[x, y, yaw] in the map frame [m, m, rad]",
}
_LEVELS = tuple(asdict(ChargingSettings()))
_SCHEMA: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["robots"],
    "description": "cost_model, decision, distance, bid_timeout, localization, battery, "
    "chargers, stand_by, robots",
    "properties": {
        "cost_model": {"enum": sorted(COST_MODELS), "description": " | ".join(COST_MODELS)},
        "decision": {"enum": list(DECISIONS), "description": " | ".join(DECISIONS)},
        "distance": {"enum": list(DISTANCES), "description": " | ".join(DISTANCES)},
        "bid_timeout": {
            "type": "number",
            "minimum": 0.1,
            "maximum": 60,
            "description": "a number of seconds, 0.1..60",
        },
        "localization": {
            "enum": list(LOCALIZATIONS),
            "description": " | ".join(LOCALIZATIONS),
        },
        "battery": {
            "type": "object",
            "additionalProperties": False,
            "description": ", ".join(_LEVELS) + ": levels from 0 to 1",
            "properties": {
                level: {
                    "type": "number",
                    "exclusiveMinimum": 0,
                    "maximum": 1,
                    "description": "a level above 0 and at most 1",
                }
                for level in _LEVELS
            },
        },
        "chargers": {
            "type": "array",
            "description": "a list of chargers, each with name and pose",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["name", "pose"],
                "description": "a charger with name and pose, and nothing else",
                "properties": {"name": {"type": "string", "minLength": 1}, "pose": _POSE},
            },
        },
        "stand_by": {
            "type": "integer",
            "minimum": 2,
            "description": "a number of robots, at least 2",
        },
        "robots": {
            "type": "array",
            "minItems": 1,
            "description": "a list of at least one robot, each with name, model and pose",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["name", "model", "pose"],
                "description": "a robot with name, model and pose, and nothing else",
                "properties": {
                    "name": {
                        "type": "string",
                        "pattern": r"^[A-Za-z][A-Za-z0-9_]{0,39}\Z",
                        "description": "a name for ROS: a letter, then letters, digits and "
                        "underscores, at most 40 in all",
                    },
                    "model": {
                        "type": "string",
                        "minLength": 1,
                        "description": "the name of a robot model, or the path of its file",
                    },
                    "pose": _POSE,
                },
            },
        },
    },
}


@dataclass(frozen=True)
class FleetRobot:
    """One robot of a fleet.

    Attributes:
        name: Its name and its ROS namespace.
        model: Name of its robot model, or the path of the model's file.
        pose: Where it starts: x [m], y [m], yaw [rad], in the map frame.
    """

    name: str
    model: str
    pose: tuple[float, float, float]


@dataclass(frozen=True)
class Fleet:
    """A fleet file's contents.

    Attributes:
        path: The file.
        robots: The robots, in the file's order, at least one.
        cost_model: How robots reckon what a task costs them.
        decision: Who works bids out: `distributed`, every robot its own, or `centralized`.
        distance: Length of a way: `path` on the map, or `euclidean` as the crow flies.
        bid_timeout: How long an auction waits for bids at most [s].
        battery: When robots charge.
        chargers: Where a robot stands at each charger [m, m, rad], by name; None: the file does
            not say, and the simulator's are used.
        localization: How robots find where they are; None: told by the simulator where there is
            one, otherwise by a node of their own.
        stand_by: How many robots, the first ones, stand by to carry the blackboard.
    """

    path: Path
    robots: tuple[FleetRobot, ...]
    cost_model: str = "report"
    decision: str = "distributed"
    distance: str = "path"
    bid_timeout: float = 2.0
    localization: str | None = None
    battery: ChargingSettings = field(default_factory=ChargingSettings)
    chargers: Mapping[str, tuple[float, float, float]] | None = None
    stand_by: int = STANDING_BY


def read_fleet(name: str) -> Fleet:
    """Read and check a fleet file.

    Args:
        name: Name of a file in `fleets/` without `.yaml`, or the path of another.

    Returns:
        The fleet; every name is good for ROS and there once, every model exists.

    Raises:
        InputError: There is no fleet of that name.
        hive_common.errors.FileError: The file has a mistake.
    """
    path = find_file("fleet_manager", "fleets", name)
    content = read_checked(path, _SCHEMA)
    robots = tuple(
        FleetRobot(entry["name"], beside(path, entry["model"]), _pose(entry["pose"]))
        for entry in content.pop("robots")
    )
    _check_names(path, robots)
    _check_starts(path, robots, _models(path, robots))
    levels = content.pop("battery", {})
    try:
        battery = ChargingSettings(**{name: float(level) for name, level in levels.items()})
    except SettingsError as error:
        raise error_at(path, ("battery",), str(error)) from None
    chargers = None
    if "chargers" in content:
        chargers = {entry["name"]: _pose(entry["pose"]) for entry in content.pop("chargers")}
    return Fleet(path, robots, battery=battery, chargers=chargers, **content)


def _pose(numbers: list[float]) -> tuple[float, float, float]:
    """Return a pose as three floats: x [m], y [m], yaw [rad]."""
    x, y, yaw = map(float, numbers)
    return x, y, yaw


def _check_names(path: Path, robots: tuple[FleetRobot, ...]) -> None:
    """Refuse a name that two robots have, or that something else in the hive has."""
    seen: dict[str, int] = {}
    for index, robot in enumerate(robots):
        keys = ("robots", index, "name")
        if robot.name in TAKEN_NAMES:
            problem = f"'{robot.name}' is the name of another part of the hive; choose another"
            raise error_at(path, keys, problem)
        if robot.name in seen:
            problem = (
                f"'{robot.name}' is the name of robots[{seen[robot.name]}] already; "
                "every robot needs a name of its own"
            )
            raise error_at(path, keys, problem)
        seen[robot.name] = index


def _models(path: Path, robots: tuple[FleetRobot, ...]) -> list[RobotModel]:
    """Return each robot's model; refuse one that is not there or that has a mistake."""
    models = []
    for index, robot in enumerate(robots):
        try:
            models.append(load_model(robot.model))
        except FileError as error:
            raise error_at(path, ("robots", index, "model"), str(error)) from None
    return models


def _check_starts(path: Path, robots: tuple[FleetRobot, ...], models: list[RobotModel]) -> None:
    """Refuse two robots that start in each other."""
    for index, robot in enumerate(robots):
        for other_index, other in enumerate(robots[:index]):
            gap = dist(robot.pose[:2], other.pose[:2])
            needed = (
                models[index].base.inscribed_radius + models[other_index].base.inscribed_radius
            )
            if gap < needed:
                problem = (
                    f"{robot.name} starts {gap:.2f} m from {other.name}; "
                    f"their bases need at least {needed:.2f} m"
                )
                raise error_at(path, ("robots", index, "pose"), problem)
