# SPDX-License-Identifier: BSD-3-Clause
"""Which robot takes which task: an optimal matching of all robots and all tasks that wait.

A robot that still carries something takes part with the place and the time at which it will be
free. A robot on its way to a pickup may be given another task. The tasks that cost least go first
(shortest processing time first), which keeps the mean service time low. Once no further tasks
come, the longest go first, so that none of them is left to the end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

if TYPE_CHECKING:
    from hive_common.geometry import Array, Indices

NOBODY = -1
EARLY = 0.2  # how much a step of a task's own length counts beside one to its pickup
LATE = -0.5  # the same once the tasks left are few for the robots
FEW = 3.0  # tasks that wait per robot


class OpenTasks(NamedTuple):
    """Tasks that nobody has picked up.

    Attributes:
        numbers: (k,) which ones.
        pickup, delivery: (k,) cells.
    """

    numbers: Indices
    pickup: Indices
    delivery: Indices


def assign(steps: Array, here: Indices, ready: Array, tasks: OpenTasks, *, last: bool) -> Indices:
    """Return the task of each robot, `NOBODY` for none.

    Args:
        steps: (cells, cells) the least number of steps between two cells.
        here: (robots,) the cell in which each is free.
        ready: (robots,) in how many steps it is.
        tasks: What waits.
        last: Whether no further tasks come.
    """
    chosen: Indices = np.full(len(here), NOBODY)
    if not len(tasks.numbers):
        return chosen
    few = last and len(tasks.numbers) <= FEW * len(here)
    length = steps[tasks.pickup, tasks.delivery]
    cost = ready[:, None] + steps[here][:, tasks.pickup] + (LATE if few else EARLY) * length
    robots, columns = linear_sum_assignment(cost)
    chosen[robots] = tasks.numbers[columns]
    return chosen
