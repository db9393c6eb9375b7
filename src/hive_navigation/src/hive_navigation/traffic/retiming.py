# SPDX-License-Identifier: BSD-3-Clause
"""Brings the times of a plan up to date when robots are late or early, and keeps its order.

Who passes a place first stays as it was planned: a robot sets out from a point when it is there,
has turned, and all that go before it have passed. So one late robot delays those that wait for it
and nobody has to be planned again. This is how an action dependency graph is executed, ahead of
time (Hoenig et al., Persistent and Robust Execution of MAPF Schedules in Warehouses, IEEE RA-L
4(2), 2019).
"""

from __future__ import annotations

import bisect
import math
from typing import TYPE_CHECKING, NamedTuple

from hive_navigation.mapf.sipp import bend, turning

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hive_navigation.mapf.path_search import Motion
    from hive_navigation.traffic.committed import Drive

STAYS = 5.0  # how long a robot is taken to stand at its goal, until it is known to stay [s]


class Course(NamedTuple):
    """What is left of a robot's course.

    Attributes:
        rest: The course from where the robot can still change it.
        ready: When it is there [s].
        heading: Its heading there [rad].
        motion: How it moves.
    """

    rest: Drive
    ready: float
    heading: float
    motion: Motion


class Times(NamedTuple):
    """When a robot gets to the points of its course, and leaves them.

    Attributes:
        arrives: [s]
        leaves: Infinite for the last [s].
    """

    arrives: tuple[float, ...]
    leaves: tuple[float, ...]


def retime(courses: Mapping[str, Course], clears: Mapping[str, float]) -> dict[str, Times]:
    """Return the times of courses in the order that was planned.

    Args:
        courses: Of robots, by name; their times are those of the last plan.
        clears: When other robots make way where they stand [s], by name. Nobody waits any more
            for those that are in neither.
    """
    arrives = {name: [course.ready] for name, course in courses.items()}
    leaves: dict[str, list[float]] = {name: [] for name in courses}
    actions = sorted(
        (course.rest.leaves[index], index, name)
        for name, course in courses.items()
        for index in range(len(course.rest.points) - 1)
    )
    waits = {
        name: {mark: [w for w in course.rest.waits if w.at == mark] for mark in course.rest.marks}
        for name, course in courses.items()
    }
    for _, index, name in actions:
        course = courses[name]
        rest = course.rest
        when = arrives[name][index] + _turning(course, index)
        for wait in waits[name][rest.marks[index]]:
            if wait.robot in courses:
                passed = _passed(courses[wait.robot], arrives[wait.robot], wait.passes)
                when = max(when, passed)
            else:
                when = max(when, clears.get(wait.robot, -math.inf))
        leaves[name].append(when)
        arrives[name].append(when + rest.arrives[index + 1] - rest.leaves[index])
    return {name: Times(tuple(arrives[name]), (*leaves[name], math.inf)) for name in courses}


def _passed(course: Course, arrives: list[float], mark: int) -> float:
    """Return when a robot passes a mark [s]; minus infinity if that is not known yet."""
    index = bisect.bisect_left(course.rest.marks, mark)
    if index == len(course.rest.marks):
        return arrives[-1] + STAYS
    return arrives[index] if index < len(arrives) else -math.inf


def _turning(course: Course, index: int) -> float:
    """Return how long a robot takes at a point to turn to where it drives next [s]."""
    points, motion = course.rest.points, course.motion
    heading = course.heading
    if index > 0:
        heading = _direction(*points[index - 1 : index + 1])
    angle = bend(heading, _direction(*points[index : index + 2]))
    return float(turning(angle, 1 / motion.yaw_rate, motion.speed / motion.acceleration))


def _direction(here: tuple[float, float], there: tuple[float, float]) -> float:
    return math.atan2(there[1] - here[1], there[0] - here[0])
