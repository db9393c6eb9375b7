# SPDX-License-Identifier: BSD-3-Clause
"""Predicts what a task takes a robot, from wherever it begins."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from blackboard.costing.cost import friction_force
from blackboard.costing.experience import Experience, by_formula
from blackboard.domain.task import StepKind, load_during, split_task

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np
    from numpy.typing import NDArray

    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths
    from blackboard.domain.task import Task
    from hive_common.pose import Pose

    Floats = NDArray[np.float64]


class Effort(NamedTuple):
    """What something takes a robot from a place on."""

    distance: float  # how far it drives [m]; infinite if there is no path
    energy: float  # what it draws from the battery [J]
    duration: float  # [s]
    end: Pose  # where it is afterwards

    def then(self, other: Effort) -> Effort:
        """Return what it takes to do this and then another."""
        return Effort(
            self.distance + other.distance,
            self.energy + other.energy,
            self.duration + other.duration,
            other.end,
        )


class Predictor:
    """Predicts the effort of one robot's drives and tasks, by default by the formula."""

    def __init__(
        self,
        robot: RobotCharacteristics,
        path_lengths: PathLengths,
        experience: Experience | None = None,
    ) -> None:
        self._robot = robot
        self._path_lengths = path_lengths
        self._experience = experience or Experience(robot)

    def drive(self, start: Pose, goal: Pose, load: float) -> Effort:
        """Return what a drive takes with a load on board [kg]."""
        return Effort(*self.leg(start, goal, self.force(load)), goal)

    def force(self, load: float) -> float:
        """Return what drives it with a load on board [kg] at constant speed [N]."""
        force = friction_force(self._robot.friction_coefficient, self._robot.mass + load)
        return self._experience.learned.friction * force

    def leg(self, start: Pose, goal: Pose, force: float) -> tuple[float, float, float]:
        """Return the distance [m], energy [J] and duration [s] of a drive with a force [N]."""
        distance, delay = self._path_lengths.length_and_delay(start, goal)
        duration = self._experience.duration(start, goal, distance) + delay
        return distance, force * distance + self._idle_power * duration, duration

    @property
    def _idle_power(self) -> float:
        return self._experience.learned.power * self._robot.idle_power

    def legs(
        self, distances: Floats, delays: Floats, turning: Floats, forces: Floats
    ) -> tuple[Floats, Floats]:
        """Return energies [J] and durations [s] of many drives, as `leg` does of one."""
        durations = self._experience.durations(distances, turning) + delays
        return forces * distances + self._idle_power * durations, durations

    def arm_work(self, kind: StepKind, here: Pose) -> Effort:
        """Return what a pick or a place takes."""
        duration = self._experience.arm_time(kind)
        power = self._experience.learned.power * self._robot.arm_power + self._idle_power
        return Effort(0.0, power * duration, duration, here)

    def effort(self, task: Task, first_step: int, start: Pose, steps: int | None = None) -> Effort:
        """Return what the rest of a task takes, or its next steps; see `Job`."""
        return Job(task, first_step, self, steps).effort_from(start)


class Job:
    """The rest of a task for one robot: the drive to where it begins, and what follows from there.

    What follows is the same wherever the robot comes from, so it is computed once for all the
    positions in a schedule that the task could have.

    Args:
        first_step: The first step that is still to be done.
        steps: How many steps count; by default all that are left.

    Attributes:
        begin: Where the drive goes; None if the robot's arm is next, or nothing is left.
        force: What drives the robot there at constant speed [N].
        rest: What follows from there; None if nothing is left.
    """

    def __init__(
        self, task: Task, first_step: int, predictor: Predictor, steps: int | None = None
    ) -> None:
        self._predictor = predictor
        self.begin: Pose | None = None
        self.force = 0.0
        self.rest: Effort | None = None
        last_step = None if steps is None else first_step + steps
        for index, step in list(enumerate(split_task(task)))[first_step:last_step]:
            rest = self.rest or Effort(0.0, 0.0, 0.0, step.goal)
            if step.kind is not StepKind.MOVE:
                self.rest = rest.then(predictor.arm_work(step.kind, rest.end))
            elif self.rest is None:
                self.begin = step.goal
                self.force = predictor.force(load_during(task, index))
                self.rest = rest
            else:
                drive = predictor.drive(rest.end, step.goal, load_during(task, index))
                self.rest = rest.then(drive)

    def effort_from(self, start: Pose) -> Effort:
        """Return what it takes from a place on; a robot whose arm is next is where it works."""
        if self.rest is None:
            return Effort(0.0, 0.0, 0.0, start)
        if self.begin is None:
            return self.rest
        # A robot does this for every place in its schedule and every task that is offered.
        distance, energy, duration = self._predictor.leg(start, self.begin, self.force)
        rest_distance, rest_energy, rest_duration, end = self.rest
        return Effort(
            distance + rest_distance, energy + rest_energy, duration + rest_duration, end
        )


def by_the_formula(
    robot: RobotCharacteristics, task: Task, first_step: int, approach: float, rest: float
) -> tuple[float, float]:
    """Return duration [s] and energy [J] of a task, or the rest of it, without any look at a map.

    Args:
        robot: What the robot is.
        task: What it does.
        first_step: The first step that is still to be done.
        approach: The length of the path to where that begins [m].
        rest: The length of all further paths [m].
    """
    steps = split_task(task)[first_step:]
    arm = sum(robot.arm_time(step.kind) for step in steps)
    duration = (approach + rest) * by_formula(robot.max_speed).per_metre + arm
    loads = load_during(task, first_step), load_during(task, first_step + len(steps) - 1)
    forces = [friction_force(robot.friction_coefficient, robot.mass + load) for load in loads]
    driving = forces[0] * approach + forces[1] * rest
    return duration, driving + robot.arm_power * arm + robot.idle_power * duration


def charge_to_reach(
    places: Iterable[Pose],
    start: Pose,
    robot: RobotCharacteristics,
    path_lengths: PathLengths,
    battery: Battery,
    experience: Experience | None = None,
) -> float:
    """Return the charge that the drive to the nearest of some places takes at most [Ah].

    One drive in ten takes more. It is 0 if there is no such place, or none can be reached.
    """
    experience = experience or Experience(robot)
    predictor = Predictor(robot, path_lengths, experience)
    drives = (predictor.drive(start, place, load=0.0) for place in places)
    nearest = min(drives, key=lambda drive: drive.distance, default=None)
    if nearest is None or not math.isfinite(nearest.distance):
        return 0.0
    return battery.charge_for(experience.most_energy(nearest.energy))
