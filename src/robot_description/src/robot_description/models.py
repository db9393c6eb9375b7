# SPDX-License-Identifier: BSD-3-Clause
"""The robot models: what each make of robot is, read from `models/<model>.yaml`.

One file describes a robot for everybody: the URDF (`urdf/robot.urdf.xacro` reads the same file),
the simulator, the planner and follower, and the robot's bids on tasks. The fields below are the
file's keys.
"""

import math
import re
from pathlib import Path
from typing import Annotated

import attrs

from hive_common.checked_yaml import read_checked
from hive_common.pose import Pose
from hive_common.resources import find_file, names_in
from hive_common.structuring import (
    Allowed,
    NotAllowedError,
    between,
    each_within,
    listed,
    one_of,
    positive,
)

Point = tuple[float, float]
Text = Annotated[str, Allowed("a text that is not empty")]
Names = Annotated[tuple[Text, ...], listed("names", unique=True)]


@attrs.frozen
class Base:
    """The mobile base."""

    drive: Annotated[str, one_of("differential", "holonomic")]
    """`differential` (forward and turn) or `holonomic` (any direction and turn)."""
    footprint: Annotated[
        tuple[Annotated[Point, each_within(5, "a corner [x, y] in base_footprint [m]")], ...],
        listed("at least 3 corners [x, y] of a convex polygon, counter-clockwise [m]", 3),
    ]
    """Corners of a convex polygon, counter-clockwise, around the origin of `base_footprint`."""
    height: Annotated[float, positive("height of the base, arm not included [m]", 3)]
    mass: Annotated[float, positive("mass of the whole robot without load [kg]", 5000)]
    max_speed: Annotated[float, positive("top speed along x, if holonomic also y [m/s]", 5)]
    max_yaw_rate: Annotated[float, positive("top turning speed [rad/s]", 10)]
    acceleration: Annotated[float, positive("acceleration and deceleration [m/s^2]", 5)]
    yaw_acceleration: Annotated[float, positive("turning acceleration [rad/s^2]", 20)]
    friction_coefficient: Annotated[float, positive("rolling friction, force/weight [-]", 1)]
    max_speed_diagonal: Annotated[float, positive("top speed on a diagonal [m/s]", 5)] | None = (
        None
    )
    """None for a differential base."""

    def __attrs_post_init__(self) -> None:
        """Refuse a bad footprint, and a diagonal speed that does not fit the drive."""
        if self.inscribed_radius <= 0:
            raise NotAllowedError(
                ["footprint"],
                f"{[list(corner) for corner in self.footprint]} is not a convex polygon around "
                "(0, 0) with its corners counter-clockwise; reorder the corners",
            )
        if self.holonomic != (self.max_speed_diagonal is not None):
            raise NotAllowedError(
                ["max_speed_diagonal"],
                f"{self.max_speed_diagonal} with drive {self.drive}; a holonomic base needs it "
                "[m/s], a differential base must not have it",
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

        Not positive if the polygon is not convex, is clockwise, or does not hold the origin.
        """
        corners = self.footprint
        edges = list(zip(corners, corners[1:] + corners[:1], strict=True))
        bends = [
            _cross(a, b, c) for (a, b), (_, c) in zip(edges, edges[1:] + edges[:1], strict=True)
        ]
        if min(bends) <= 0:
            return 0.0
        return min(_cross(a, b, (0.0, 0.0)) / math.dist(a, b) for a, b in edges)


@attrs.frozen
class BatteryData:
    """The battery's figures."""

    capacity: Annotated[float, positive("capacity [Ah]", 1000)]
    voltage_full: Annotated[float, positive("voltage at full charge [V]", 500)]
    voltage_empty: Annotated[float, positive("voltage at which the robot shuts down [V]", 500)]
    charging_time: Annotated[float, positive("time from empty to full [s]", 86400)]
    idle_power: Annotated[float, positive("power drawn standing still [W]", 2000)]

    def __attrs_post_init__(self) -> None:
        """Refuse a battery whose voltage does not fall."""
        if self.voltage_full <= self.voltage_empty:
            raise NotAllowedError(
                ["voltage_full"],
                f"{self.voltage_full:g} V is not above voltage_empty {self.voltage_empty:g} V; "
                "the full battery must have the higher voltage",
            )


@attrs.frozen
class Laser:
    """The laser scanner."""

    beams: Annotated[int, between(8, 10_000, "number of beams")]
    """Spread evenly over the field of view."""
    range_min: Annotated[float, positive("shortest distance measured [m]", 5)]
    range_max: Annotated[float, positive("longest distance measured [m]", 100)]
    field_of_view: Annotated[float, positive("field of view, 2 pi is all around [rad]", 6.2832)]
    rate: Annotated[float, positive("scans per second [Hz]", 100)]
    pose: Annotated[Pose, each_within(6.2832, "[x, y, yaw] in base_footprint [m, m, rad]")]

    def __attrs_post_init__(self) -> None:
        """Refuse a laser that measures nothing."""
        if self.range_max <= self.range_min:
            raise NotAllowedError(
                ["range_max"],
                f"{self.range_max:g} m is not above range_min {self.range_min:g} m; "
                "the laser would measure nothing",
            )


@attrs.frozen
class Arm:
    """The arm of a mobile manipulator."""

    payload: Annotated[float, positive("what the arm can lift [kg]", 1000)]
    reach: Annotated[float, positive("reach [m]", 5)]
    repeatability: Annotated[float, positive("repeatability [m]", 0.1)]
    pick_duration: Annotated[float, positive("time for one pick [s]", 600)]
    place_duration: Annotated[float, positive("time for putting one thing down [s]", 600)]
    power: Annotated[float, positive("power drawn while the arm moves [W]", 5000)]
    accuracy: Annotated[float, positive("accuracy [m]", 0.1)] | None = None
    """None where the maker gives none."""


@attrs.frozen(kw_only=True)
class RobotModel:
    """One make of robot."""

    name: Annotated[
        str,
        Allowed(
            "a name of small letters, digits and _, such as mir100",
            re.compile(r"[a-z][a-z0-9_]*").fullmatch,
        ),
    ]
    """Also the name of its file."""
    kind: Annotated[str, one_of("agv", "amr", "mobile_manipulator", "tracked", "legged")]
    maker: Text
    source: Text
    """Title, maker and year of the data sheet."""
    base: Base
    payload: Annotated[float, positive("what the robot can carry [kg]", 5000)]
    battery: BatteryData
    laser: Laser
    """What the fleet gives the robot, besides the maker's `sensors`."""
    arm: Arm | None = None
    capabilities: Annotated[
        tuple[Annotated[str, one_of("GA", "GAB", "GPA", "GPAB")], ...],
        listed("task types out of GA, GAB, GPA, GPAB", 1, unique=True),
    ]
    interfaces: Names
    """Standard interfaces the robot offers, such as `move_base`, `pick`."""
    communication: Names
    """Networks the robot can be reached over."""
    sensors: Names

    def __attrs_post_init__(self) -> None:
        """Refuse a robot that promises picks without an arm, or whose kind denies its arm."""
        picks = sorted({"GPA", "GPAB"} & set(self.capabilities))
        if picks and self.arm is None:
            raise NotAllowedError(
                ["capabilities"], f"{', '.join(picks)} need an arm; add `arm:` or remove them"
            )
        if (self.kind == "mobile_manipulator") != (self.arm is not None):
            has = "an" if self.arm else "no"
            raise NotAllowedError(
                ["kind"],
                f"{self.kind} with {has} arm; a mobile_manipulator has one, others have none",
            )


def model_names() -> tuple[str, ...]:
    """Return the names of the models that come with this package, sorted."""
    return tuple(names_in("robot_description", "models"))


def model_path(name_or_path: str | Path) -> Path:
    """Return the file of a model: by the name of a model of this package, or by its path.

    Raises:
        FileError: There is no such model.
    """
    return find_file("robot_description", "models", str(name_or_path))


def load_model(name_or_path: str | Path) -> RobotModel:
    """Read and check a robot model; every figure is in SI units, charge in Ah.

    Args:
        name_or_path: The name of a model of this package (`mir100`), or the path of a YAML file.

    Raises:
        FileError: There is no such file, or it holds something that is not allowed.
    """
    return read_checked(model_path(name_or_path), RobotModel)


def _cross(a: Point, b: Point, c: Point) -> float:
    """Return twice the signed area of the triangle a, b, c; positive if counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
