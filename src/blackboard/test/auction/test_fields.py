# SPDX-License-Identifier: BSD-3-Clause
"""Distance fields that the process beside the leader computes, and those of the path lengths."""

from itertools import pairwise

import numpy as np
import pytest

from blackboard.auction.search.fields import fields, time_for
from blackboard.costing import grid_path_lengths
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.costing.traffic_conditions import NO_TRAFFIC, SlowPlace, TrafficConditions
from blackboard.domain.path_lengths import FieldJob, Moves
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_common.zone import ONE_WAY, SLOW, Zone

LEFT, RIGHT, SHUT_IN = Pose(1.0, 1.0), Pose(8.0, 5.0), Pose(9.5, 0.5)
ACROSS = ((3.0, 0.0), (6.0, 0.0), (6.0, 3.0), (3.0, 3.0))
IN_TRAFFIC = TrafficConditions(
    (
        Zone(name="up", kind=ONE_WAY, direction=0.0, corners=ACROSS),
        Zone(name="door", kind=SLOW, speed=0.3, corners=((4.0, 4.0), (6.0, 4.0), (5.0, 9.0))),
        Zone(name="crawl", kind=SLOW, speed=0.001, corners=((6.0, 3.0), (7.0, 3.0), (7.0, 6.0))),
    ),
    (SlowPlace(5.0, 4.0, 30.0), SlowPlace(2.0, 2.0, 3.0)),
)


def rooms():
    """Return a hall with a wall in its middle, and a room without a door in a corner."""
    blocked = np.zeros((120, 200), dtype=bool)
    blocked[:80, 98:102] = True
    blocked[20, 180:] = blocked[:20, 180] = True
    return GridMap.of_blocked(blocked, 0.05)


def both(traffic):
    """Return path lengths that take in fields, and others that compute them."""
    return [GridPathLengths(rooms(), 0.2, traffic) for _ in range(2)]


def hand_over(path_lengths, *ways):
    """Compute what is wanted, and return how many fields that was."""
    wanted = path_lengths.wanted(ways)
    wanted.keep(list(fields(wanted.job)))
    return len(wanted.job.goals)


def columns(path_lengths):
    """Return lengths and delays between all places, and the time that was counted [s]."""
    places = [LEFT, RIGHT, SHUT_IN, Pose(-1.0, -1.0)]
    found = zip(*path_lengths.columns(places, places), strict=True)
    lengths, delays, taken = map(np.array, found)
    return lengths, delays, sum(taken)


def test_without_traffic_they_are_the_same_to_the_last_digit():
    handed, own = both(NO_TRAFFIC)

    assert hand_over(handed, [LEFT], [RIGHT], [SHUT_IN]) == 3
    for found, computed in zip(columns(handed)[:2], columns(own)[:2], strict=True):
        np.testing.assert_array_equal(found, computed)


def test_in_traffic_they_have_lengths_and_delays_of_the_same_paths():
    handed, own = both(IN_TRAFFIC)

    assert hand_over(handed, [LEFT], [RIGHT], [SHUT_IN]) == 3
    for found, computed in zip(columns(handed)[:2], columns(own)[:2], strict=True):
        np.testing.assert_allclose(found, computed, rtol=1e-9, atol=1e-9)
    assert columns(handed)[1].max() > 1.0


def test_what_was_handed_over_takes_hardly_any_time():
    handed, own = both(NO_TRAFFIC)
    hand_over(handed, [LEFT], [RIGHT], [SHUT_IN])

    assert columns(handed)[2] < columns(own)[2] / 10


def test_what_is_there_is_not_wanted_again():
    path_lengths, _ = both(NO_TRAFFIC)
    hand_over(path_lengths, [LEFT])
    path_lengths.length(LEFT, RIGHT)

    assert path_lengths.wanted([[LEFT], [LEFT]]) is None
    assert hand_over(path_lengths, [LEFT], [RIGHT], [RIGHT]) == 1
    assert path_lengths.wanted([[Pose(-1.0, -1.0)], [], [RIGHT]]) is None


def test_along_a_way_every_second_field_is_enough_where_paths_are_symmetric(monkeypatch):
    way = [LEFT, RIGHT, Pose(1.0, 5.0), Pose(8.0, 1.0)]
    alone, in_traffic = both(NO_TRAFFIC)[0], both(IN_TRAFFIC)[0]

    assert hand_over(alone, way) == 2
    assert hand_over(in_traffic, way) == 4
    monkeypatch.setattr(grid_path_lengths.csgraph, "dijkstra", None)  # nothing more is computed
    for start, goal in pairwise(way):
        assert 0.0 < alone.length(start, goal) < in_traffic.length(start, goal) + 1.0


def test_fields_of_other_conditions_are_not_kept():
    path_lengths, own = both(NO_TRAFFIC)[0], both(IN_TRAFFIC)[0]
    wanted = path_lengths.wanted([[RIGHT]])
    path_lengths.use(rooms(), IN_TRAFFIC)
    wanted.keep(list(fields(wanted.job)))

    assert path_lengths.wanted([[RIGHT]]) is not None
    assert path_lengths.length_and_delay(LEFT, RIGHT) == own.length_and_delay(LEFT, RIGHT)


def test_many_are_wanted_one_part_after_the_other_and_no_more_than_are_kept(monkeypatch):
    path_lengths, _ = both(NO_TRAFFIC)
    monkeypatch.setattr(grid_path_lengths, "_MAX_FIELDS", 40)
    ways = [[Pose(1.0 + 0.2 * (n % 15), 1.0 + 0.2 * (n // 15))] for n in range(60)]
    found = []
    while path_lengths.wanted(ways) is not None:
        found.append(hand_over(path_lengths, *ways))

    assert found == [25, 15]


def test_what_is_there_already_is_not_dropped_for_what_is_wanted_with_it(monkeypatch):
    path_lengths, _ = both(NO_TRAFFIC)
    monkeypatch.setattr(grid_path_lengths, "_MAX_FIELDS", 2)
    hand_over(path_lengths, [LEFT], [SHUT_IN])

    assert hand_over(path_lengths, [LEFT], [RIGHT]) == 1
    assert path_lengths.wanted([[LEFT], [RIGHT]]) is None


def test_a_node_without_moves_has_a_path_to_itself_only():
    nothing = np.zeros(0)
    moves = Moves(np.zeros(3, np.int32), np.zeros(0, np.int32), nothing, nothing)
    ((lengths, lost),) = fields(FieldJob(moves, [1]))

    assert (lengths.tolist(), lost) == ([np.inf, 0.0], None)


def test_the_time_that_is_counted_grows_with_moves_and_goals():
    path_lengths, _ = both(NO_TRAFFIC)
    job = path_lengths.wanted([[LEFT], [RIGHT]]).job

    assert time_for(job) == pytest.approx(2 * time_for(FieldJob(job.moves, job.goals[:1])))
