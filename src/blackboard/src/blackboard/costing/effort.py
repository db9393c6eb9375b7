# SPDX-License-Identifier: BSD-3-Clause
"""What it takes a robot to do a task, from wherever it begins."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blackboard.costing.cost import friction_force
from blackboard.costing.pace import Pace
from blackboard.domain.task import StepKind, Task, TaskType, load_during, split_task
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from blackboard.domain.battery import Battery
    from blackboard.domain.characteristics import RobotCharacteristics
    from blackboard.domain.path_lengths import PathLengths


@dataclass(frozen=True, slots=True)
class Effort:
    """What it takes a robot to do a task from a place on.

    Attributes:
        way: How far it drives [m]; infinite where there is no way.
        energy: What it draws [J].
        duration: How long it takes [s].
        end: Where it stands afterwards.
    """

    way: float
    energy: float
    duration: float
    end: Pose

    def then(self, other: Effort) -> Effort:
        """Return what it takes to do this and then another."""
        return Effort(
            self.way + other.way,
            self.energy + other.energy,
            self.duration + other.duration,
            other.end,
        )


class Job:
    """The rest of a task for one robot: the drive to where it begins, and what follows from there.

    What follows is the same wherever the robot comes from, so it is worked out once for all the
    places in a list that the task could have.

    Args:
        task: A task that `analyze_task` has passed.
        first_step: The first step that is still to be done.
        robot: What the robot is.
        ways: Knows how far it is.
        steps: How many steps count; all that are left where none is given.
        pace: Knows how long its drives take; the rule of thumb, where it is left out.
    """

    def __init__(
        self,
        task: Task,
        first_step: int,
        robot: RobotCharacteristics,
        path_lengths: PathLengths,
        steps: int | None = None,
        pace: Pace | None = None,
    ) -> None:
        self._robot = robot
        self._path_lengths = path_lengths
        self._pace = pace or Pace(robot.max_speed)
        last_step = None if steps is None else first_step + steps
        todo = list(enumerate(split_task(task)))[first_step:last_step]
        self._begin: Pose | None = None
        self._force = 0.0
        self._rest: Effort | None = None
        if not todo:
            return
        index, step = todo[0]
        if step.kind is StepKind.MOVE:
            self._begin = step.goal
            self._force = self._friction(task, index)
            todo = todo[1:]
        rest = Effort(0.0, 0.0, 0.0, step.goal)
        for index, step in todo:
            if step.kind is StepKind.MOVE:
                rest = rest.then(self._drive(rest.end, step.goal, self._friction(task, index)))
            else:
                time = robot.arm_time(step.kind)
                energy = (robot.arm_power + robot.idle_power) * time
                rest = rest.then(Effort(0.0, energy, time, rest.end))
        self._rest = rest

    def effort_from(self, start: Pose) -> Effort:
        """Return what it takes from a place on; a robot that is at work is where it works."""
        if self._rest is None:
            return Effort(0.0, 0.0, 0.0, start)
        if self._begin is None:
            return self._rest
        return self._drive(start, self._begin, self._force).then(self._rest)

    def reach(self, start: Pose) -> tuple[float, float]:
        """Return way [m] and duration [s] from a place on; see `effort_from`."""
        if self._rest is None:
            return 0.0, 0.0
        if self._begin is None:
            return self._rest.way, self._rest.duration
        way = self._path_lengths.length(start, self._begin)
        duration = self._pace.duration(start, self._begin, way)
        return way + self._rest.way, duration + self._rest.duration

    def end_from(self, start: Pose) -> Pose:
        """Return where the robot stands afterwards."""
        return start if self._rest is None else self._rest.end

    def _friction(self, task: Task, step: int) -> float:
        mass = self._robot.mass + load_during(task, step)
        return friction_force(self._robot.friction_coefficient, mass)

    def _drive(self, start: Pose, goal: Pose, force: float) -> Effort:
        way = self._path_lengths.length(start, goal)
        duration = self._pace.duration(start, goal, way)
        return Effort(way, force * way + self._robot.idle_power * duration, duration, goal)


class Series:
    """Jobs that a robot does one after the other, put into its list as one.

    Args:
        jobs: One at least, each of a task of which something is left to do.
        weights: What a second of waiting for each counts.

    Attributes:
        weight: What a second of waiting for all counts.
        waiting: What is waited from the end of the first until each is done, by their weights [s].
    """

    def __init__(self, jobs: Sequence[Job], weights: Sequence[float]) -> None:
        self._first, *others = jobs
        self._rest: Effort | None = None
        self.weight, self.waiting = sum(weights), 0.0
        for job, weight in zip(others, weights[1:], strict=True):
            done = self._rest or Effort(0.0, 0.0, 0.0, self._first.end_from(Pose(0.0, 0.0)))
            self._rest = done.then(job.effort_from(done.end))
            self.waiting += weight * self._rest.duration

    def reach(self, start: Pose) -> tuple[float, float, float]:
        """Return way [m], duration [s], and duration [s] of the first alone, from a place on."""
        way, duration = self._first.reach(start)
        if self._rest is None:
            return way, duration, duration
        return way + self._rest.way, duration + self._rest.duration, duration

    def end_from(self, start: Pose) -> Pose:
        """Return where the robot stands afterwards."""
        return self._first.end_from(start) if self._rest is None else self._rest.end

    def effort_from(self, start: Pose) -> Effort:
        """Return what it takes from a place on."""
        first = self._first.effort_from(start)
        return first if self._rest is None else first.then(self._rest)


def effort(
    task: Task,
    first_step: int,
    start: Pose,
    robot: RobotCharacteristics,
    path_lengths: PathLengths,
    steps: int | None = None,
    pace: Pace | None = None,
) -> Effort:
    """Predict what it takes a robot to do the rest of a task, or its next steps; see `Job`."""
    return Job(task, first_step, robot, path_lengths, steps, pace).effort_from(start)


def charge_to_reach(
    places: Iterable[Pose],
    start: Pose,
    robot: RobotCharacteristics,
    path_lengths: PathLengths,
    battery: Battery,
) -> float:
    """Return the charge that the drive to the nearest of some places takes [Ah].

    It is 0 where none can be reached, or there is none.
    """
    drives = (
        effort(Task("", TaskType.GA, (place,)), 0, start, robot, path_lengths) for place in places
    )
    nearest = min(drives, key=lambda drive: drive.way, default=None)
    if nearest is None or not math.isfinite(nearest.way):
        return 0.0
    return battery.charge_for(nearest.energy)
