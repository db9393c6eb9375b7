# SPDX-License-Identifier: BSD-3-Clause
"""The simulation: robots in a world, moved in steps of time.

    simulation = Simulation(load_world("lab"), seed=1)
    simulation.add_robot("robot1", load_model("mir100"), Pose(2.0, 2.0, 0.0))
    simulation.set_command("robot1", vx=0.5)
    for _ in range(40):
        simulation.step()
    simulation.poses["robot1"], simulation.scan("robot1"), simulation.collisions

It is free of ROS and of the wall clock. The same seed and the same calls give the same run to the
last bit.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import shapely.geometry

from hive_common.geometry import Footprint
from hive_common.pose import Pose
from simenv.bodies.bodies import Bodies
from simenv.bodies.contact import Contacts
from simenv.bodies.pick import Arm, Stock
from simenv.errors import ObstacleError, SpawnError, UnknownRobotError
from simenv.noise import Noise, dice_of
from simenv.sensors.laser import Scanner, Scanners
from simenv.world.surroundings import Surroundings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely.geometry.base import BaseGeometry

    from hive_common.geometry import Array
    from robot_description.models import RobotModel
    from simenv.bodies.contact import Contact
    from simenv.world.world import World

STEP = 0.025  # the default step [s]: odometry at 20 Hz and scans at 10 Hz fall on whole steps
MAX_STEP = 0.1  # in a longer step [s] a fast robot could jump over a thin wall


@dataclass(frozen=True)
class _Robot:
    """What a robot has besides its base."""

    model: RobotModel
    footprint: Footprint
    arm: Arm
    scanner: Scanner
    start: Pose


class Simulation:
    """Robots in a world."""

    def __init__(
        self,
        world: World,
        *,
        seed: int = 0,
        noise: Noise | None = None,
        pick_failures: float = 0.0,
        start: int = 0,
    ) -> None:
        """Start without robots.

        Args:
            world: What robots sense and bump into.
            seed: Of all random numbers, at least 0.
            noise: Of the sensors; None for the default.
            pick_failures: Probability that a grip fails, 0..1.
            start: The time at which it starts [ns].
        """
        self.world = world
        self.stock = Stock(world.stations)  # what is left to pick at its stations
        self._seed = seed
        self._noise = noise or Noise()
        self._pick_failures = pick_failures
        self._surroundings = Surroundings(world)
        self.obstacles = self._surroundings.obstacles  # people, doors, and other things in the way
        self._contacts = Contacts(self._surroundings)
        self._bodies = Bodies(self._contacts, self._noise)
        self._robots: dict[str, _Robot] = {}
        self._mount()
        self._nanoseconds = start

    @property
    def nanoseconds(self) -> int:
        """Simulated time [ns], an integer so that it never drifts."""
        return self._nanoseconds

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._nanoseconds * 1e-9

    @property
    def names(self) -> tuple[str, ...]:
        """The robots' names, in the order of their addition."""
        return tuple(self._robots)

    @property
    def collisions(self) -> int:
        """Number of contacts so far, robot-wall and robot-robot."""
        return len(self._contacts.noted)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts so far, `collisions` in number."""
        return tuple(self._contacts.noted)

    @property
    def poses(self) -> dict[str, Pose]:
        """The true poses of all robots, frame map."""
        return dict(self._bodies.poses)

    def add_robot(
        self, name: str, model: RobotModel, pose: Pose | tuple[float, float, float]
    ) -> None:
        """Put a robot into the world.

        Args:
            name: Letters, digits and _, with a letter first, as ROS demands.
            model: What it is.
            pose: Of its base, frame map [m, m, rad].

        Raises:
            SpawnError: The name is in use or not allowed, or something is in the way.
        """
        pose = Pose(*map(float, pose))
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
            raise SpawnError(
                f"robot name '{name}': allowed are letters, digits and _, with a letter first"
            )
        if name in self._robots:
            raise SpawnError(
                f"{name}: the name is taken; remove that robot or choose another name"
            )
        footprint = Footprint(model.base.footprint)
        reason = self.obstacles.refusal(footprint, pose)
        if not reason:
            other = self._robot_at(shapely.geometry.Polygon(footprint.at(pose)))
            reason = f"{other} is there; choose a free place" if other else ""
        if reason:
            raise SpawnError(f"{name} cannot stand at {pose}: {reason}")
        self._contacts.add(name, footprint)
        dice = dice_of(self._seed, name)
        self._bodies.add(name, model, pose, dice.wheels)
        self._robots[name] = _Robot(
            model=model,
            footprint=footprint,
            arm=Arm(model, self.stock, dice.arm, self._pick_failures),
            scanner=Scanner(model.laser, self._noise.laser, dice.laser),
            start=pose,
        )
        self._mount()

    def _standing(self) -> dict[str, tuple[Footprint, Pose]]:
        """Return all robots' footprints and where they are."""
        poses = self._bodies.poses
        return {name: (robot.footprint, poses[name]) for name, robot in self._robots.items()}

    def reset(self) -> None:
        """Return robots, people, doors, loads and contacts to the start.

        Time goes on, because it must never run backwards.
        """
        self.obstacles.reset()
        self.stock.refill()
        self._contacts.reset()
        for name, robot in self._robots.items():
            robot.arm.reset()
            self._bodies.put_back(name, robot.start)

    def set_door(self, name: str, *, is_open: bool) -> None:
        """Open or shut a door; raise ObstacleError if it is unknown or a robot stands in it."""
        self._check_nobody(name, self.obstacles.door_area(name))
        self.obstacles.set_door(name, is_open=is_open)

    def block(self, name: str, area: BaseGeometry) -> None:
        """Put an obstacle down, frame map [m]; raise ObstacleError if a robot stands there."""
        self._check_nobody(name, area)
        self.obstacles.put(name, area)

    def _robot_at(self, area: BaseGeometry) -> str | None:
        """Return a robot that an area overlaps, frame map, or None."""
        for name, (footprint, pose) in self._standing().items():
            if area.intersects(shapely.geometry.Polygon(footprint.at(pose))):
                return name
        return None

    def _check_nobody(self, name: str, area: BaseGeometry) -> None:
        robot = self._robot_at(area)
        if robot is not None:
            raise ObstacleError(f"'{name}': {robot} stands there; send it away first")

    def bumper(self, name: str) -> tuple[str, ...]:
        """Return what a robot touches: names of obstacles and robots, '' for a wall."""
        self._robot(name)
        return self._contacts.touching(name)

    def set_slip(self, name: str, share: float) -> None:
        """Make a robot's wheels slip: `share` (0..1) of every turn moves nothing."""
        self._robot(name)
        self._bodies.slip(name, share)

    def freeze(self, name: str, *, is_frozen: bool) -> None:
        """Make a robot's base stop and ignore commands, or release it."""
        self._robot(name)
        self._bodies.freeze(name, is_frozen=is_frozen)

    def remove_robot(self, name: str) -> None:
        """Remove a robot."""
        self._robot(name)
        self._contacts.remove(name)
        self._bodies.remove(name)
        del self._robots[name]
        self._mount()

    def set_command(self, name: str, vx: float = 0.0, vy: float = 0.0, wz: float = 0.0) -> None:
        """Command a robot's base to move; it stops by itself after `COMMAND_TIMEOUT`.

        Args:
            name: The robot.
            vx: Forward [m/s].
            vy: To the left [m/s]; a differential base ignores it.
            wz: Counter-clockwise [rad/s].

        Raises:
            UnknownRobotError: There is no such robot.
            CommandError: A speed is not a finite number.
        """
        self._robot(name)
        self._bodies.command(name, (vx, vy, wz), self.time)

    def step(self, dt: float = STEP) -> None:
        """Let `dt` [s] pass, above 0 and at most `MAX_STEP`."""
        if not 0 < dt <= MAX_STEP:
            raise ValueError(f"a step of {dt} s; allowed: above 0 and at most {MAX_STEP} s")
        loads = [robot.arm.payload for robot in self._robots.values()]
        if self.world.people:
            self.obstacles.step(dt, self._standing().values())
        self._bodies.step(self.time, loads, dt)
        self._nanoseconds += round(dt * 1e9)
        for name, robot in self._robots.items():
            if robot.arm.busy:
                robot.arm.step(self._bodies.poses[name], dt)

    def velocity(self, name: str) -> tuple[float, float, float]:
        """Return the velocity of a robot in its base_footprint (vx, vy, wz) [m/s, m/s, rad/s]."""
        self._robot(name)
        return self._bodies.velocity(name)

    def odometry(self, name: str) -> Pose:
        """Return the pose that a robot's wheels measure, from where it was put down."""
        self._robot(name)
        return self._bodies.odometry(name)

    def model(self, name: str) -> RobotModel:
        """Return the model of a robot."""
        return self._robot(name).model

    def arm(self, name: str) -> Arm:
        """Return a robot's arm, for orders and their results."""
        return self._robot(name).arm

    def scanner(self, name: str) -> Scanner:
        """Return a robot's laser scanner."""
        return self._robot(name).scanner

    def scan(self, name: str) -> Array:
        """Return the distances (beams,) that a robot's laser measures [m]; see `Scanner.read`."""
        return self.scans([name])[0]

    def scans(self, names: Sequence[str]) -> list[Array]:
        """Take a scan with each of some robots' lasers at once; see `scan`."""
        rows = [self._bodies.row(name) for name in names if self._robot(name)]
        return self._scanners.take(rows, self._bodies.true, self._surroundings)

    def _mount(self) -> None:
        """Take note of all robots' scanners."""
        scanners = [robot.scanner for robot in self._robots.values()]
        self._scanners = Scanners(scanners, self._contacts.footprints)

    def _robot(self, name: str) -> _Robot:
        if name not in self._robots:
            known = ", ".join(self._robots) or "none"
            raise UnknownRobotError(f"robot '{name}': not known; in the simulation: {known}")
        return self._robots[name]
