# SPDX-License-Identifier: BSD-3-Clause
"""Robots and tasks as arrays of numbers.

A task is one piece of work from where it begins to where it ends, whatever it visits in between,
so the legs of one task stay together. What a robot can no longer put off is not a task here: it
defines where and when the robot is free.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from blackboard.errors import AllocationError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Numbers = NDArray[np.int64]

Plan = tuple[tuple[int, ...], ...]
"""The tasks of each robot in their order."""


@dataclass(frozen=True)
class Problem:
    """One allocation problem; robots and tasks are named by their numbers.

    Robots that drive alike are of one kind. Nodes are the end of each task, then where each robot
    becomes free; `nothing`, a task that takes nothing, lies between them.

    Attributes:
        kind: (robots,) kind of each robot.
        leg: (kinds, tasks + 1 + robots, tasks + 1) time of the drive from each node to the
            beginning of each task [s]. `nothing` has a row and a column of 0.
        leg_draw: The same, energy of the drive [J].
        own: (kinds, tasks + 1) time from the beginning of a task to its end [s].
        own_draw: (kinds, tasks + 1) energy for that [J].
        ready: (robots,) time until a robot is free [s].
        most: (robots,) time at which it has to be done with everything [s]; infinite for none.
        weight: (tasks,) what a second of waiting counts, above 0; usually 1.
        priority: (tasks,) higher ones stand before lower ones in every list.
        able: (robots, tasks) whether a robot may do a task.

    Raises:
        AllocationError: An array has another shape, or holds a number that is not allowed.
    """

    kind: Numbers
    leg: Floats
    leg_draw: Floats
    own: Floats
    own_draw: Floats
    ready: Floats
    most: Floats
    weight: Floats
    priority: Numbers
    able: NDArray[np.bool_]

    def __post_init__(self) -> None:
        robots, tasks, kinds = self.kind.size, self.weight.size, self.leg.shape[0]
        shapes = {
            "leg": (kinds, tasks + 1 + robots, tasks + 1),
            "leg_draw": (kinds, tasks + 1 + robots, tasks + 1),
            "own": (kinds, tasks + 1),
            "own_draw": (kinds, tasks + 1),
            "priority": (tasks,),
            "able": (robots, tasks),
        }
        for each in fields(self):
            values = getattr(self, each.name)
            in_robots = each.name in {"kind", "ready", "most"}
            shape = shapes.get(each.name, (robots,) if in_robots else (tasks,))
            if values.shape != shape:
                raise AllocationError(
                    f"{each.name} is an array of {values.shape}; needed: {shape}"
                )
            above_0, has_bound = each.name == "weight", each.name == "most"
            good = (values > 0) if above_0 else (values >= 0)
            if not (good & (np.isfinite(values) | has_bound)).all():
                raise AllocationError(
                    f"{each.name} holds {values.min()!r} to {values.max()!r}; allowed: finite "
                    f"numbers {'above' if above_0 else 'from'} 0"
                )

    @property
    def nothing(self) -> int:
        """The number that stands for no task at the end of a list."""
        return int(self.weight.size)

    def energy(self, robot: int, row: Sequence[int]) -> float:
        """Return what a list draws [J]."""
        kind, node, drawn = self.kind[robot], self.nothing + 1 + robot, 0.0
        for task in row:
            drawn += float(self.leg_draw[kind, node, task] + self.own_draw[kind, task])
            node = task
        return drawn

    def times(self, robot: int, row: Sequence[int]) -> list[float]:
        """Return when a robot is done with each task of a list [s]."""
        kind, node, at, done = self.kind[robot], self.nothing + 1 + robot, self.ready[robot], []
        for task in row:
            at += self.leg[kind, node, task] + self.own[kind, task]
            node = task
            done.append(float(at))
        return done

    @property
    def robots(self) -> int:
        """The number of robots."""
        return int(self.kind.size)


def finite(table: Floats) -> Floats:
    """Return a table in which what is infinite is as much as all the rest together.

    So no list gets shorter by a drive that is not possible.
    """
    known = np.isfinite(table)
    return table if known.all() else np.where(known, table, table[known].sum())
