# SPDX-License-Identifier: BSD-3-Clause
"""Plans paths for all robots at once, so that no two are in one place at one time."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Agent:
    """A robot as the joint planner sees it.

    Attributes:
        start: The place from which it is planned.
        ready: When it is there [s].
        heading: Its heading there, frame map [rad].
        goal: The place to which it drives.
        radius: Of the circle around its footprint [m].
        speed: Its highest speed [m/s].
        acceleration: [m/s^2]
        yaw_rate: Its highest turning speed [rad/s].
        priority: The lesser of two is planned first.
        stays: Whether it cannot be moved: it picks, charges, is defect or follows no plan.
    """

    start: int
    ready: float
    heading: float
    goal: int
    radius: float
    speed: float
    acceleration: float
    yaw_rate: float
    priority: float
    stays: bool = False


@dataclass(frozen=True)
class Timetable:
    """When a robot is where, by a plan.

    Attributes:
        places: Indices of the places that it passes, its start first.
        arrives: When it reaches each [s].
        leaves: When it leaves each [s]; infinite for the last.
        complete: Whether it gets to its goal within the horizon.
    """

    places: tuple[int, ...]
    arrives: tuple[float, ...]
    leaves: tuple[float, ...]
    complete: bool
