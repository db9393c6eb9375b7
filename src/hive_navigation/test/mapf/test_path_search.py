# SPDX-License-Identifier: BSD-3-Clause
"""What one robot does among the reservations of others, at the borders of time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hive_common.grid_map import GridMap
from hive_lab.mapf.testing import grid_map
from hive_navigation.mapf.conflicts import Conflicts, classical_conflicts, ways
from hive_navigation.mapf.ends import joined_ends
from hive_navigation.mapf.path_search import Motion, PathSearch, Task
from hive_navigation.mapf.reservations import Reservations
from hive_navigation.mapf.roadmap_builder import build_roadmap
from hive_navigation.planning.clearance import ClearanceField

MOTION = Motion(0.3, 1.0, 0.8, 1.5)
STATES = 1000


def free(roadmap):
    """Return the reservations of nobody, where robots are points."""
    conflicts = classical_conflicts(roadmap)
    nothing = Conflicts(np.zeros_like(conflicts.begins), np.empty(0, dtype=np.intp))
    things = int(ways(roadmap).max()) + 1 + len(roadmap.places)
    return Reservations(things, [[(conflicts, nothing)]])


@pytest.mark.parametrize(("dwell", "until"), [(5.0, 7.0), (math.inf, math.inf)])
def test_a_robot_at_its_goal_has_been_there_for_ever_and_stays_from_now_on(dwell, until):
    roadmap, number = grid_map(["..."])
    here = number[0, 1]
    search = PathSearch(roadmap, ways(roadmap), MOTION)

    path = search.find(Task(here, 2.0, 0.0, here), 0, free(roadmap), math.inf, STATES, dwell)

    assert path.complete
    assert path.times.tolist() == [[-math.inf, until]]


def test_a_path_that_takes_longer_than_it_may_is_not_looked_for_to_its_end():
    roadmap, number = grid_map(["......"])
    search = PathSearch(roadmap, ways(roadmap), MOTION)
    task = Task(number[0, 0], 2.0, math.pi, number[0, 5])
    waits = free(roadmap)
    waits.block(1, 0, np.array([search.thing(number[0, 3])], dtype=np.intp), -math.inf, 20.0)

    soonest = search.find(task, 0, waits, 30.0, STATES).end
    found = {
        late: search.find(task, 0, waits, 30.0, STATES, latest=soonest + late)
        for late in (-0.1, 0.1)
    }

    assert soonest > 20.0
    assert found[-0.1] is None
    assert found[0.1].complete
    assert found[0.1].end == soonest


def test_a_robot_whose_goal_is_taken_ends_as_near_as_it_can_in_the_time_that_it_may_take():
    roadmap, number = grid_map(["......", ".####.", "......"])
    search = PathSearch(roadmap, ways(roadmap), MOTION)
    task = Task(number[0, 0], 0.0, math.pi / 2, number[2, 4])
    taken = free(roadmap)
    for place in ((2, 4), (2, 3), (2, 2)):
        things = np.array([search.thing(number[place])], dtype=np.intp)
        taken.block(1, 0, things, -math.inf, math.inf)

    def end(latest):
        path = search.find(task, 0, taken, 30.0, STATES, latest=latest)
        assert not path.complete
        assert path.end + path.left <= latest
        return int(search.places_of(path.actions[-1:])[0])

    assert end(math.inf) == number[2, 5]
    assert end(search.alone(task) + 0.1) == number[2, 1]


@pytest.mark.parametrize("seed", range(10))
def test_alone_a_robot_takes_from_end_to_end_what_its_fastest_path_takes(seed):
    draw = np.random.default_rng(seed)
    blocked = np.ones((80, 120), dtype=bool)
    blocked[2:-2, 2:-2] = False
    blocked[30:50, 40:80] = True
    field = ClearanceField.of(GridMap.of_blocked(blocked, 0.1))
    roadmap = build_roadmap(field, [MOTION.radius])
    free_places = roadmap.places[draw.choice(len(roadmap.places), 2, replace=False)]
    points = free_places + draw.uniform(0.05, 0.1, (2, 2))
    ends = joined_ends(roadmap, field, points, np.full(2, MOTION.radius), [], [], [0])
    search = PathSearch(roadmap, ways(roadmap), MOTION)
    search.join(ends)
    things = int(ways(roadmap).max()) + 1 + len(roadmap.places) + len(ends.points) + len(ends.legs)
    actions = len(search.graph.to)
    nothing = Conflicts(np.zeros(actions + 1, dtype=np.intp), np.empty(0, dtype=np.intp))
    task = Task(*ends.index[:1].tolist(), 3.0, float(draw.uniform(-3.0, 3.0)), int(ends.index[1]))

    path = search.find(task, 0, Reservations(things, [[(nothing, nothing)]]), math.inf, 10_000)

    assert path.complete
    assert search.alone(task) > 0.0
    assert path.end - task.ready == pytest.approx(search.alone(task))
