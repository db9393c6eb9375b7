# SPDX-License-Identifier: BSD-3-Clause
"""Who passes first is decided for every place where two courses come too near, without a cycle."""

import itertools

import numpy as np
import pytest

from hive_navigation.mapf.dependency_graph import Course, dependencies

GAP = 0.1
RADIUS = 0.4


def course(points, begins, radius=RADIUS):
    return Course(np.array(points, dtype=float), np.array(begins, dtype=float), radius)


def line(start, step, count, begin=0.0):
    points = np.asarray(start, dtype=float) + np.outer(np.arange(count), step)
    return course(points, begin + np.arange(count))


def test_courses_that_stay_apart_do_not_wait_for_each_other():
    assert not len(dependencies([line((0, 0), (1, 0), 4), line((0, 2), (1, 0), 4)], GAP))


def test_at_a_crossing_the_one_that_comes_later_waits_until_the_other_has_passed():
    first = line((0, 0), (1, 0), 5)
    second = line((2, -4), (0, 1), 8, begin=1.0)

    found = dependencies([first, second], GAP).tolist()

    assert {who for who, *_ in found} == {1}
    # It stops two metres off; the other one has passed when it has reached (3, 0).
    assert [1, 3, 0, 2] in found


def test_a_robot_that_follows_another_keeps_behind_it():
    found = dependencies([line((0, 0), (1, 0), 5), line((-2, 0), (1, 0), 5)], GAP).tolist()

    assert [1, 1, 0, 0] in found
    assert {who for who, *_ in found} == {1}


def test_nobody_drives_to_where_another_one_stands_at_its_end():
    standing = course([(3.0, 0.0)], [0.0])

    found = dependencies([line((0, 0), (1, 0), 5, begin=1.0), standing], GAP).tolist()

    assert [0, 2, 1, 0] in found


def test_large_robots_wait_where_small_ones_pass():
    paths = [line((0, 0), (1, 0), 4), line((0, 0.6), (1, 0), 4)]
    small = [course(each.points, each.begins, 0.2) for each in paths]

    assert len(dependencies(paths, GAP))
    assert not len(dependencies(small, GAP))


@pytest.mark.parametrize("seed", range(20))
def test_the_graph_of_random_courses_has_no_cycle_and_leaves_no_conflict_undecided(seed):
    random = np.random.default_rng(seed)
    courses = []
    for _ in range(8):
        steps = random.integers(-1, 2, (12, 2)).astype(float)
        points = random.uniform(0, 6, 2) + np.cumsum(steps, axis=0)
        courses.append(course(points, np.cumsum(random.uniform(0.1, 2.0, 12)), RADIUS))

    found = dependencies(courses, GAP).tolist()

    for me, mine, other, its in found:
        assert (courses[other].begins[its], other) < (courses[me].begins[mine], me)
    latest = {(me, mine, other): its for me, mine, other, its in found}
    for (me, one), (other, two) in itertools.permutations(enumerate(courses), 2):
        for mine, its in itertools.product(range(11), range(11)):
            earlier = (two.begins[its], other) < (one.begins[mine], me)
            if earlier and apart(one.points[mine : mine + 2], two.points[its : its + 2]) < 0.9:
                assert latest.get((me, mine, other), -1) >= its


def apart(one, two):
    """Return about how far two segments are from each other, never less than they are [m]."""
    shares = np.linspace(0, 1, 21)[:, None]
    there = one[0] + shares * (one[1] - one[0])
    other = two[0] + shares * (two[1] - two[0])
    return np.linalg.norm(there[:, None] - other[None, :], axis=2).min()
