# SPDX-License-Identifier: BSD-3-Clause
"""Random tasks of all types for benchmarks, at places where every robot of a fleet can stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from numpy.random import Generator

    from hive_common.grid_map import GridMap

ROOM = 0.9  # least distance of a goal from anything that is not free [m]

PAYLOADS = {TaskType.GA: 0.0, TaskType.GAB: 40.0, TaskType.GPA: 0.4, TaskType.GPAB: 0.4}
"""Largest payload by task type [kg]; any arm of the default fleet can lift the least."""


def random_tasks(grid: GridMap, random: Generator, avoid: Collection[Pose] = ()) -> Iterator[Task]:
    """Yield tasks for ever: the types in turn, goals evenly over the free floor.

    `avoid` are poses, such as passages, that goals stay 1.5 m away from.
    """
    padded = np.pad(~grid.blocked, 1)
    clear = ndimage.distance_transform_edt(padded)[1:-1, 1:-1] * grid.resolution
    for pose in avoid:
        rows, columns = np.ogrid[: clear.shape[0], : clear.shape[1]]
        x, y = columns * grid.resolution + grid.origin.x, rows * grid.resolution + grid.origin.y
        clear[np.hypot(x - pose.x, y - pose.y) < 1.5] = 0.0  # noqa: PLR2004  (said above)
    rows, columns = np.nonzero(clear >= ROOM)
    number = 0
    while True:
        number += 1
        kind = TaskType(number % len(TaskType))
        chosen = random.integers(len(rows), size=kind.goals_needed)
        goals = tuple(
            Pose(
                grid.origin.x + (float(columns[cell]) + 0.5) * grid.resolution,
                grid.origin.y + (float(rows[cell]) + 0.5) * grid.resolution,
                float(random.uniform(-math.pi, math.pi)),
            )
            for cell in chosen
        )
        payload = float(random.uniform(0.0, PAYLOADS[kind]))
        yield Task(f"T{number}", kind, goals, payload=payload)
