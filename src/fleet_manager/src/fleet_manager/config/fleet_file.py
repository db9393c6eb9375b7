# SPDX-License-Identifier: BSD-3-Clause
"""Reads fleet files: which robots there are, where they start, and how the hive decides.

The files in `fleets/` are the manual of the format. A mistake that shows only after the start
costs an operator time, so everything that can be known beforehand is checked here.
"""

import re
from collections.abc import Iterator
from math import dist
from pathlib import Path
from typing import Annotated

import attrs

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.charger import Charger
from blackboard.domain.settings import (
    DECISIONS,
    DISTANCES,
    STANDING_BY,
    TRAFFIC,
    ChargingSettings,
)
from fleet_manager.config.zenoh_site import BLACKBOARD, ROS_NAME, ZenohSite, mistakes_in_site
from hive_common.checked_yaml import error_at, named_at, read_all_mistakes
from hive_common.errors import FileError
from hive_common.geometry import Footprint, outline
from hive_common.pose import Pose
from hive_common.resources import beside, find_file
from hive_common.structuring import Allowed, between, listed, one_of
from hive_common.zone import Zone
from robot_description.models import load_model
from vda5050.mqtt.link import BrokerSettings
from vda5050.protocol.topics import TopicPart
from vda5050.protocol.versions import Version

TAKEN_NAMES = frozenset({
    "blackboard", "simenv", "fleet_manager", "launch_fleet", "map_server", "rviz", "hive",
    "task_markers", "task_entry", "task_view", "rosout", "map", "odom", "clock", "tf",
    "hive_gateway",
})  # fmt: skip
"""Names that nodes, topics or frames of the hive already have; no robot may have them."""

PROCESSES = ("each", "shared")
"""Whether each node of a robot has a process, or a few processes host simulated robots."""

LOCALIZATIONS = ("fake_localization", "amcl", "none")
"""How a robot finds where it is: told by the simulator, by laser and map, or by another node."""

NAVIGATIONS = ("ours", "none")
"""Whose `move_base` drives a robot: the hive's own, or that of another node."""

NAMES = ("namespaced", "stock")
"""Whether a real robot's own nodes have its name in front of theirs, or the names of ROS's stack,
such as /move_base, because the robot has a ROS master of its own."""

STOCK_PLAN = "move_base/NavfnROS/plan"
"""Where ROS's own `move_base` publishes its planned path with navfn."""

_PLAN_TOPIC = Allowed(
    "the name of a topic in the robot's namespace, such as move_base/NavfnROS/plan",
    lambda value: (
        re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*", value) is not None
    ),
)

DRIVERS = ("move_base", "vda5050")
"""What robots are driven by: the actions of ROS, or messages of VDA 5050."""

TRANSPORTS = ("ros", "zenoh")
"""What carries the hive's messages: ROS topics of one master, or Zenoh between many."""

_UNKNOWN_BASE = ((-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01))
"""In place of the base of an AGV that tells of it itself [m]."""

_TOUCH = 1e-6
"""Bases that are nearer to each other touch [m]."""

_MapPose = Annotated[Pose, Allowed("[x, y, yaw] in the map frame [m, m, rad]")]


@attrs.frozen(kw_only=True)
class AgvOnBroker:
    """What an AGV is called at the broker, and speaks."""

    manufacturer: TopicPart = "RoboHive"
    serial: TopicPart | None = None
    """None: the robot's name."""
    version: Annotated[str, one_of(*(version.value for version in Version))] = "2.1"
    """Of VDA 5050."""
    interface: TopicPart | None = None
    """The first part of its topics; None: what its version proposes."""
    maker: Annotated[str, Allowed("the name of a maker's file, or its path")] = "standard"
    """What its maker calls actions, and where its maps lie."""


@attrs.frozen(kw_only=True)
class FleetRobot:
    """One robot of a fleet."""

    name: Annotated[str, ROS_NAME]
    """Also its ROS namespace."""
    model: Annotated[str, Allowed("the name of a robot model, or the path of its file")] = ""
    """Empty, for an AGV with `driver: vda5050` that is not simulated: what its factsheet tells."""
    pose: _MapPose
    """Where it starts."""
    localization: Annotated[str, one_of(*LOCALIZATIONS)] | None = None
    """None: as the fleet's."""
    navigation: Annotated[str, one_of(*NAVIGATIONS)] | None = None
    """None: as the fleet's."""
    plan: Annotated[str, _PLAN_TOPIC] | None = None
    """The topic of its planned path, to be shown; None: as the fleet's."""
    names: Annotated[str, one_of(*NAMES)] | None = None
    """What the topics of its own nodes are called, if it is real; None: as the fleet's."""
    driver: Annotated[str, one_of(*DRIVERS)] = "move_base"
    """What it is driven by."""
    simulated: bool = False
    """Whether an AGV with `driver: vda5050` is simulated; others are as the launch file says."""
    vda5050: AgvOnBroker = attrs.field(factory=AgvOnBroker)
    """What an AGV with `driver: vda5050` is called and speaks."""

    @property
    def is_agv(self) -> bool:
        """Whether it speaks VDA 5050."""
        return self.driver == "vda5050"

    @property
    def has_stock_names(self) -> bool:
        """Whether its own nodes, if it is real, have the names of ROS's stack."""
        return self.names == "stock" and not self.is_agv


def plan_topic(robot: FleetRobot) -> str | None:
    """Return the topic of a robot's path, in its namespace; None if our `move_base` plans it."""
    return robot.plan or (STOCK_PLAN if robot.navigation == "none" else None)


@attrs.frozen(kw_only=True)
class FleetContent:
    """What a fleet file holds."""

    cost_model: Annotated[str, one_of(*COST_MODELS)] = "report"
    """How robots work out what a task costs them."""
    decision: Annotated[str, one_of(*DECISIONS)] = "planned"
    """Robots bid (`distributed`), the leader bids for all (`centralized`), or it plans for all
    (`planned`)."""
    distance: Annotated[str, one_of(*DISTANCES)] = "path"
    """Path lengths: `path` on the map, or `euclidean` as the crow flies."""
    bid_timeout: Annotated[float, between(0.1, 60, "a number of seconds")] = 2.0
    """How long an auction waits for bids at most [s]."""
    localization: Annotated[str, one_of(*LOCALIZATIONS)] | None = None
    """None: the simulator tells robots where they are; without one, a node of their own does."""
    navigation: Annotated[str, one_of(*NAVIGATIONS)] = "ours"
    """Whose `move_base` drives the robots: `ours`, or with `none` that of a node of their own."""
    plan: Annotated[str, _PLAN_TOPIC] | None = None
    """The topic of each robot's planned path; None: the usual one of its navigation."""
    names: Annotated[str, one_of(*NAMES)] = "namespaced"
    """What the topics of a real robot's own nodes are called."""
    battery: ChargingSettings = attrs.field(factory=ChargingSettings)
    """When robots charge."""
    chargers: tuple[Charger, ...] | None = None
    """None: those of the simulator's world."""
    processes: Annotated[str, one_of(*PROCESSES)] | None = None
    """None: `shared` in simulation; real robots have `each` in any case."""
    traffic: Annotated[str, one_of(*TRAFFIC)] = "local"
    """Who decides which robot goes first: the robots, or a traffic planner."""
    broker: BrokerSettings | None = None
    """Where AGVs with `driver: vda5050` are found; None: one of its own on this machine."""
    zones: tuple[Zone, ...] = ()
    """Areas in which a traffic planner limits how robots drive."""
    transport: Annotated[str, one_of(*TRANSPORTS)] = "ros"
    """What carries the hive's messages."""
    zenoh: ZenohSite = attrs.field(factory=ZenohSite)
    """How members reach each other with `transport: zenoh`."""
    stand_by: Annotated[int, between(2, 10_000, "a number of robots")] = STANDING_BY
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
    fleet, mistakes = read_fleet_and_mistakes(name)
    if fleet is None or mistakes:
        raise mistakes[0]
    return fleet


def read_fleet_and_mistakes(name: str) -> tuple[Fleet | None, list[FileError]]:
    """Return a fleet, and every mistake in its file; None where it is not even a fleet file.

    Raises:
        hive_common.errors.FileError: There is no such fleet, or its file cannot be read at all.
    """
    path = find_file("fleet_manager", "fleets", name)
    content, mistakes = read_all_mistakes(path, FleetContent)
    if content is None:
        return None, mistakes
    robots = tuple(
        attrs.evolve(
            robot,
            model=robot.model and beside(path, robot.model),
            localization=robot.localization or content.localization,
            navigation=robot.navigation or content.navigation,
            plan=robot.plan or content.plan,
            names=robot.names or content.names,
        )
        for robot in content.robots
    )
    zenoh = content.zenoh
    if zenoh.certificates:
        folder = path.parent / Path(zenoh.certificates).expanduser()
        zenoh = attrs.evolve(zenoh, certificates=str(folder.absolute()))
    given = attrs.asdict(content, recurse=False) | {"robots": robots, "zenoh": zenoh}
    fleet = Fleet(path=path, **given)
    mistakes = [
        *_names(fleet),
        *_stock_names(path, content),
        *_zones(fleet),
        *mistakes_in_connections(fleet),
    ]
    bases, bad_models = _bases(fleet)
    return fleet, [*mistakes, *bad_models, *_overlaps(fleet, bases)]


def _names(fleet: Fleet) -> Iterator[FileError]:
    """Yield the names that another robot or another part of the hive has."""
    seen: dict[str, int] = {}
    for index, robot in enumerate(fleet.robots):
        keys = ("robots", index, "name")
        if robot.name in TAKEN_NAMES:
            problem = f"'{robot.name}' is the name of another part of the hive; choose another"
            yield error_at(fleet.path, keys, problem)
        if robot.name in seen:
            problem = (
                f"'{robot.name}' is already the name of robots[{seen[robot.name]}]; "
                "every robot needs a name of its own"
            )
            yield error_at(fleet.path, keys, problem)
        seen[robot.name] = index


def _stock_names(path: Path, content: FleetContent) -> Iterator[FileError]:
    """Yield what a robot with the names of ROS's stack cannot be told to have besides."""
    for index, robot in enumerate(content.robots):
        if (robot.names or content.names) != "stock":
            continue
        where = ("robots", index)
        if robot.is_agv:
            if robot.names is not None:
                problem = "'stock'; an AGV with driver: vda5050 has no topics; leave names out"
                yield error_at(path, (*where, "names"), problem)
            continue
        for key in ("navigation", "localization"):
            given = getattr(robot, key)
            if given not in (None, "none"):
                problem = (
                    f"'{given}'; allowed with names: stock: none, because nodes of the hive have "
                    "the robot's name in front"
                )
                yield error_at(path, (*where, key), problem)


def _zones(fleet: Fleet) -> Iterator[FileError]:
    """Yield the names that two zones have."""
    names = [zone.name for zone in fleet.zones]
    for index, name in enumerate(names):
        first = names.index(name)
        if first != index:
            problem = (
                f"'{name}' is already the name of zones[{first}]; "
                "every zone needs a name of its own"
            )
            yield error_at(fleet.path, ("zones", index, "name"), problem)


def mistakes_in_connections(fleet: Fleet) -> Iterator[FileError]:
    """Yield what is wrong with how members reach each other over Zenoh."""
    members = [BLACKBOARD, *(robot.name for robot in fleet.robots)]
    for keys, problem in mistakes_in_site(fleet.zenoh, members):
        yield error_at(fleet.path, keys, problem)


def read_connections(name: str) -> Fleet:
    """Read a fleet file of which only the connections matter: no robot's model has to be here.

    Raises:
        hive_common.errors.FileError: There is no such fleet, its file is none, or members cannot
            reach each other as it says.
    """
    fleet, mistakes = read_fleet_and_mistakes(name)
    if fleet is None:
        raise mistakes[0]
    for mistake in mistakes_in_connections(fleet):
        raise mistake
    return fleet


def base_of(robot: FleetRobot) -> Footprint:
    """Return the base of a robot; a small one for an AGV whose factsheet tells of it later.

    Raises:
        hive_common.errors.FileError: There is no such model, or its file has a mistake.
    """
    return Footprint(load_model(robot.model).base.footprint if robot.model else _UNKNOWN_BASE)


def _bases(fleet: Fleet) -> tuple[list[Footprint], list[FileError]]:
    """Return the base of each robot, and the models that are missing or have a mistake."""
    bases, mistakes = [], []
    for index, robot in enumerate(fleet.robots):
        try:
            if not robot.model and not (robot.is_agv and not robot.simulated):
                problem = (
                    "model is missing; allowed: the name of a robot model, or the path of its "
                    "file. Only an AGV with driver: vda5050 that is not simulated needs none"
                )
                raise error_at(fleet.path, ("robots", index), problem)
            with named_at(fleet.path, "robots", index, "model"):
                bases.append(base_of(robot))
        except FileError as error:
            mistakes.append(error)
            bases.append(Footprint(_UNKNOWN_BASE))
    return bases, mistakes


def _overlaps(fleet: Fleet, bases: list[Footprint]) -> Iterator[FileError]:
    """Yield the robots that stand in another one at the start."""
    for index, robot in enumerate(fleet.robots):
        for before, other in enumerate(fleet.robots[:index]):
            base, others = bases[index], bases[before]
            gap = dist(robot.pose[:2], other.pose[:2])
            if gap < base.radius + others.radius and (
                base.touches(robot.pose, outline(others.at(other.pose)), _TOUCH)
                or others.touches(other.pose, outline(base.at(robot.pose)), _TOUCH)
            ):
                problem = (
                    f"{robot.name} starts at {robot.pose}, {gap:.2f} m from {other.name}: their "
                    "bases overlap; move one of them"
                )
                yield error_at(fleet.path, ("robots", index, "pose"), problem)
