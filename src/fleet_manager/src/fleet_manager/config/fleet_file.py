# SPDX-License-Identifier: BSD-3-Clause
"""Reads fleet files: which robots there are, where they start, and how the hive decides.

The files in `fleets/` are the manual of the format. A mistake that shows only after the start
costs an operator time, so everything that can be known beforehand is checked here.
"""

import re
from math import dist
from pathlib import Path
from typing import Annotated

import attrs

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.settings import (
    DECISIONS,
    DISTANCES,
    STANDING_BY,
    TRAFFIC,
    ChargingSettings,
)
from hive_common.checked_yaml import error_at, read_checked
from hive_common.errors import FileError
from hive_common.pose import Pose
from hive_common.resources import beside, find_file
from hive_common.structuring import Allowed, Name, at_least, between, listed, one_of
from hive_common.zone import Zone
from robot_description.models import RobotModel, load_model

TAKEN_NAMES = frozenset({
    "blackboard", "simenv", "fleet_manager", "launch_fleet", "map_server", "rviz", "hive",
    "task_markers", "task_entry", "task_view", "rosout", "map", "odom", "clock", "tf",
})  # fmt: skip
"""Names that nodes, topics or frames of the hive already have; no robot may have them."""

PROCESSES = ("each", "shared")
"""Whether each node of a robot has a process, or a few processes host simulated robots."""

_MapPose = Annotated[Pose, Allowed("[x, y, yaw] in the map frame [m, m, rad]")]


@attrs.frozen(kw_only=True)
class FleetRobot:
    """One robot of a fleet."""

    name: Annotated[
        str,
        Allowed(
            "a name for ROS: a letter, then letters, digits and underscores, at most 40 in all",
            re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}").fullmatch,
        ),
    ]
    """Also its ROS namespace."""
    model: Annotated[str, Allowed("the name of a robot model, or the path of its file")]
    pose: _MapPose
    """Where it starts."""


@attrs.frozen(kw_only=True)
class Charger:
    """Where a robot stands to charge."""

    name: Name
    pose: _MapPose


@attrs.frozen(kw_only=True)
class FleetContent:
    """What a fleet file holds."""

    cost_model: Annotated[str, one_of(*COST_MODELS)] = "report"
    """How robots work out what a task costs them."""
    decision: Annotated[str, one_of(*DECISIONS)] = "distributed"
    """Who works out bids: `distributed`, each robot its own, or `centralized`."""
    distance: Annotated[str, one_of(*DISTANCES)] = "path"
    """Path lengths: `path` on the map, or `euclidean` as the crow flies."""
    bid_timeout: Annotated[float, between(0.1, 60, "a number of seconds")] = 2.0
    """How long an auction waits for bids at most [s]."""
    localization: Annotated[str, one_of("fake_localization", "amcl", "none")] | None = None
    """None: the simulator tells robots where they are; without one, a node of their own does."""
    battery: ChargingSettings = attrs.field(factory=ChargingSettings)
    """When robots charge."""
    chargers: tuple[Charger, ...] | None = None
    """None: those of the simulator's world."""
    processes: Annotated[str, one_of(*PROCESSES)] | None = None
    """None: `shared` in simulation; real robots have `each` in any case."""
    traffic: Annotated[str, one_of(*TRAFFIC)] = "local"
    """Who says who goes first where robots meet: the robots, or a traffic planner."""
    zones: tuple[Zone, ...] = ()
    """Areas in which a traffic planner limits how robots drive."""
    stand_by: Annotated[int, at_least(2, "a number of robots")] = STANDING_BY
    """How many robots, the first ones, stand by to carry the blackboard."""
    robots: Annotated[tuple[FleetRobot, ...], listed("at least one robot", 1)]


@attrs.frozen(kw_only=True)
class Fleet(FleetContent):
    """A fleet file that was read and checked."""

    path: Path


def read_fleet(name: str) -> Fleet:
    """Read and check a fleet file, given by its name in `fleets/` without `.yaml` or by its path.

    Every name is then good for ROS and unique, and every model exists.

    Raises:
        hive_common.errors.FileError: There is no such fleet, or its file has a mistake.
    """
    path = find_file("fleet_manager", "fleets", name)
    content = read_checked(path, FleetContent)
    robots = tuple(
        attrs.evolve(robot, model=beside(path, robot.model)) for robot in content.robots
    )
    _check_names(path, robots)
    _check_zones(path, content.zones)
    _check_starts(path, robots, _models(path, robots))
    given = attrs.asdict(content, recurse=False) | {"robots": robots}
    return Fleet(path=path, **given)


def _check_names(path: Path, robots: tuple[FleetRobot, ...]) -> None:
    """Refuse a name that another robot or another part of the hive has."""
    seen: dict[str, int] = {}
    for index, robot in enumerate(robots):
        keys = ("robots", index, "name")
        if robot.name in TAKEN_NAMES:
            problem = f"'{robot.name}' is the name of another part of the hive; choose another"
            raise error_at(path, keys, problem)
        if robot.name in seen:
            problem = (
                f"'{robot.name}' is already the name of robots[{seen[robot.name]}]; "
                "every robot needs a name of its own"
            )
            raise error_at(path, keys, problem)
        seen[robot.name] = index


def _check_zones(path: Path, zones: tuple[Zone, ...]) -> None:
    """Refuse a name that two zones have."""
    names = [zone.name for zone in zones]
    for index, name in enumerate(names):
        first = names.index(name)
        if first != index:
            problem = (
                f"'{name}' is already the name of zones[{first}]; "
                "every zone needs a name of its own"
            )
            raise error_at(path, ("zones", index, "name"), problem)


def _models(path: Path, robots: tuple[FleetRobot, ...]) -> list[RobotModel]:
    """Return the model of each robot; refuse one that is missing or has a mistake."""
    models = []
    for index, robot in enumerate(robots):
        try:
            models.append(load_model(robot.model))
        except FileError as error:
            raise error_at(path, ("robots", index, "model"), str(error)) from None
    return models


def _check_starts(path: Path, robots: tuple[FleetRobot, ...], models: list[RobotModel]) -> None:
    """Refuse robots that overlap at the start."""
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


def check_zones_on_map(fleet: Fleet, bounds: tuple[float, float, float, float]) -> None:
    """Refuse a zone that lies beside the map: most often its corners are in other units.

    Args:
        fleet: A fleet file.
        bounds: x_min, y_min, x_max, y_max of the map, frame map [m].

    Raises:
        hive_common.errors.FileError: A zone has no part on the map.
    """
    x_min, y_min, x_max, y_max = bounds
    for index, zone in enumerate(fleet.zones):
        xs, ys = zip(*zone.corners, strict=True)
        if max(xs) <= x_min or min(xs) >= x_max or max(ys) <= y_min or min(ys) >= y_max:
            problem = (
                f"x {min(xs):g}..{max(xs):g}, y {min(ys):g}..{max(ys):g} [m] is beside the map; "
                f"allowed: x {x_min:g}..{x_max:g}, y {y_min:g}..{y_max:g}"
            )
            raise error_at(fleet.path, ("zones", index, "corners"), problem)
