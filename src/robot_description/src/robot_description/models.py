# SPDX-License-Identifier: BSD-3-Clause
"""The robot models: what each make of robot is, read from `models/<model>.yaml`.

One file describes a robot for everybody: the URDF (`urdf/robot.urdf.xacro` reads the same file),
the simulator, the planner and follower, and the robot's bids on tasks. The classes here mirror the
file key by key, so a key found in a file is found under the same name in the code.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from hive_common.checked_yaml import read_checked
from hive_common.errors import FileError
from hive_common.resources import find_file, names_in
from robot_description.errors import ModelError
from robot_description.model_schema import SCHEMA

if TYPE_CHECKING:
    from pathlib import Path

Point = tuple[float, float]


@dataclass(frozen=True)
class Base:
    """The mobile base.

    Attributes:
        drive: `differential` (forward and turn) or `holonomic` (any direction and turn).
        footprint: Corners of a convex polygon, counter-clockwise, around the origin of
            `base_footprint` [m].
        height: Height of the base, arm not included [m].
        mass: Mass of the whole robot without load [kg].
        max_speed: Top speed along x, for a holonomic base along y too [m/s].
        max_speed_diagonal: Top speed along a diagonal [m/s]; None for a differential base.
        max_yaw_rate: [rad/s]
        acceleration: Also the deceleration [m/s^2].
        yaw_acceleration: [rad/s^2]
        friction_coefficient: Rolling friction, force over weight [-].
    """

    drive: str
    footprint: tuple[Point, ...]
    height: float
    mass: float
    max_speed: float
    max_yaw_rate: float
    acceleration: float
    yaw_acceleration: float
    friction_coefficient: float
    max_speed_diagonal: float | None = None

    def __post_init__(self) -> None:
        """Refuse what the schema of the file cannot express."""
        if self.inscribed_radius <= 0:
            raise ModelError(
                f"base.footprint: {[list(corner) for corner in self.footprint]} is not a convex "
                "polygon around (0, 0) with its corners counter-clockwise; reorder the corners"
            )
        if self.holonomic != (self.max_speed_diagonal is not None):
            raise ModelError(
                f"base.max_speed_diagonal: {self.max_speed_diagonal} with drive {self.drive}; "
                "a holonomic base needs it [m/s], a differential base must not have it"
            )

    @property
    def holonomic(self) -> bool:
        """Whether the base can move sideways."""
        return self.drive == "holonomic"

    @property
    def circumscribed_radius(self) -> float:
        """Radius of the smallest circle around the origin that holds the footprint [m]."""
        return max(math.hypot(x, y) for x, y in self.footprint)

    @property
    def inscribed_radius(self) -> float:
        """Radius of the largest circle around the origin inside the footprint [m].

        It is not positive if the polygon is not convex, not counter-clockwise, or beside the
        origin, which is how bad footprints are found.
        """
        corners = self.footprint
        edges = list(zip(corners, corners[1:] + corners[:1], strict=True))
        bends = [
            _cross(a, b, c) for (a, b), (_, c) in zip(edges, edges[1:] + edges[:1], strict=True)
        ]
        if min(bends) <= 0:
            return 0.0
        return min(_cross(a, b, (0.0, 0.0)) / math.dist(a, b) for a, b in edges)


@dataclass(frozen=True)
class BatteryData:
    """The battery's figures.

    Attributes:
        capacity: [Ah]
        voltage_full: Voltage at full charge [V].
        voltage_empty: Voltage at which the robot switches off [V].
        charging_time: From empty to full [s].
        idle_power: What the robot draws standing still [W].
    """

    capacity: float
    voltage_full: float
    voltage_empty: float
    charging_time: float
    idle_power: float

    def __post_init__(self) -> None:
        """Refuse a battery whose voltage does not fall."""
        if self.voltage_full <= self.voltage_empty:
            raise ModelError(
                f"battery.voltage_full: {self.voltage_full} V is not above voltage_empty "
                f"{self.voltage_empty} V; the full battery must have the higher voltage"
            )


@dataclass(frozen=True)
class Laser:
    """The laser scanner.

    Attributes:
        beams: Number of beams, spread evenly over the field of view.
        range_min: Closest distance that is measured [m].
        range_max: Farthest distance that is measured [m].
        field_of_view: [rad], 2 pi is all around.
        rate: Scans per second [Hz].
        pose: x, y, yaw of the laser in `base_footprint` [m, m, rad].
    """

    beams: int
    range_min: float
    range_max: float
    field_of_view: float
    rate: float
    pose: tuple[float, float, float]

    def __post_init__(self) -> None:
        """Refuse a laser that measures nothing."""
        if self.range_max <= self.range_min:
            raise ModelError(
                f"laser.range_max: {self.range_max} m is not above range_min {self.range_min} m; "
                "the laser would measure nothing"
            )


@dataclass(frozen=True)
class Arm:
    """The arm of a mobile manipulator.

    Attributes:
        payload: What the arm can lift [kg].
        reach: [m]
        repeatability: How near to each other it comes back to a place [m].
        pick_duration: Time for one pick [s].
        place_duration: Time for putting one thing down [s].
        power: What the arm draws while it moves [W].
        accuracy: How near to the wanted place it comes [m]; None where the maker gives none.
    """

    payload: float
    reach: float
    repeatability: float
    pick_duration: float
    place_duration: float
    power: float
    accuracy: float | None = None


@dataclass(frozen=True)
class RobotModel:
    """One make of robot.

    Attributes:
        name: The model's name; also the name of its file.
        kind: What sort of robot, out of `model_schema.KINDS`.
        maker: Who builds the robot.
        source: Title, maker and year of the data sheet.
        base: The mobile base.
        payload: What the robot can carry [kg].
        battery: The battery.
        laser: The laser scanner.
        arm: The arm; None for a robot without one.
        capabilities: Task types the robot can do, out of `GA`, `GAB`, `GPA`, `GPAB`.
        interfaces: Standard interfaces the robot offers, such as `move_base`, `pick`.
        communication: Networks the robot can be reached over.
        sensors: What the maker's robot senses with; `laser` is what the fleet gives it besides.
    """

    name: str
    kind: str
    maker: str
    source: str
    base: Base
    payload: float
    battery: BatteryData
    laser: Laser
    arm: Arm | None
    capabilities: tuple[str, ...]
    interfaces: tuple[str, ...]
    communication: tuple[str, ...]
    sensors: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse a robot that promises picks without an arm, or is called by what it has not."""
        picks = sorted({"GPA", "GPAB"} & set(self.capabilities))
        if picks and self.arm is None:
            raise ModelError(
                f"capabilities: {', '.join(picks)} need an arm; add `arm:` or remove them"
            )
        if (self.kind == "mobile_manipulator") != (self.arm is not None):
            has = "an" if self.arm else "no"
            raise ModelError(
                f"kind: {self.kind} with {has} arm; a mobile_manipulator has one, others have none"
            )


def model_names() -> tuple[str, ...]:
    """Return the names of the models that come with this package, sorted."""
    return tuple(names_in("robot_description", "models"))


def model_path(name_or_path: str | Path) -> Path:
    """Return the file of a model.

    Args:
        name_or_path: The name of a model of this package, or the path of a YAML file.

    Raises:
        FileError: There is no such model.
    """
    return find_file("robot_description", "models", str(name_or_path))


def load_model(name_or_path: str | Path) -> RobotModel:
    """Read and check a robot model.

    Args:
        name_or_path: The name of a model of this package (`mir100`), or the path of a YAML file.

    Returns:
        The model; every figure in SI units, charge in Ah.

    Raises:
        FileError: There is no such file, or it holds something that is not allowed.
    """
    path = model_path(name_or_path)
    try:
        return model_from_dict(read_checked(path, SCHEMA))
    except ModelError as error:
        raise FileError(f"{path}: {error}") from None


def model_from_dict(content: dict[str, Any]) -> RobotModel:
    """Build a model from what its YAML file, or the ROS parameters made from it, hold.

    Args:
        content: A dict that fits `model_schema.SCHEMA`.

    Raises:
        ModelError: Two figures contradict each other.
    """
    parts = {"base": Base, "battery": BatteryData, "laser": Laser, "arm": Arm}
    values: dict[str, Any] = {"arm": None}
    for key, value in content.items():
        part = parts.get(key)
        values[key] = _frozen(value) if part is None else part(**_frozen_items(value))
    known = {field.name for field in fields(RobotModel)}
    return RobotModel(**{key: value for key, value in values.items() if key in known})


def _frozen_items(content: dict[str, Any]) -> dict[str, Any]:
    return {key: _frozen(value) for key, value in content.items()}


def _frozen(value: Any) -> Any:  # noqa: ANN401  (what YAML holds)
    """Turn lists into tuples, so that a frozen dataclass is frozen all the way down."""
    return tuple(_frozen(item) for item in value) if isinstance(value, list) else value


def _cross(a: Point, b: Point, c: Point) -> float:
    """Return twice the signed area of the triangle a, b, c; positive if counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
