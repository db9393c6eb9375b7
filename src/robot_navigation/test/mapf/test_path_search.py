# SPDX-License-Identifier: BSD-3-Clause
"""What one robot does among the reservations of others, at the borders of time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hive_lab.mapf.testing import grid_map
from robot_navigation.mapf.conflicts import Conflicts, classical_conflicts, ways
from robot_navigation.mapf.path_search import Motion, PathSearch, Task
from robot_navigation.mapf.reservations import Reservations


@pytest.mark.parametrize(("dwell", "until"), [(5.0, 7.0), (math.inf, math.inf)])
def test_a_robot_at_its_goal_has_been_there_for_ever_and_stays_from_now_on(dwell, until):
    roadmap, number = grid_map(["..."])
    here = number[0, 1]
    search = PathSearch(roadmap, ways(roadmap), Motion(0.3, 1.0, 0.8, 1.5))
    conflicts = classical_conflicts(roadmap)
    nothing = Conflicts(np.zeros_like(conflicts.begins), np.empty(0, dtype=np.intp))
    things = int(ways(roadmap).max()) + 1 + len(roadmap.places)
    free = Reservations(things, [[(conflicts, nothing)]])

    path = search.find(Task(here, 2.0, 0.0, here), 0, free, math.inf, 100, dwell)

    assert path.complete
    assert path.times.tolist() == [[-math.inf, until]]
