# SPDX-License-Identifier: BSD-3-Clause
"""What `./hive bench allocation` makes of plans, on instances small enough to check by hand."""

import numpy as np
import pytest

from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.settings import DECISIONS, BlackboardSettings
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.allocation.exact import optimum
from hive_lab.allocation.testing import on_a_road
from hive_lab.bench.allocation.first_plan import first_plan
from hive_lab.bench.allocation.instances import KINDS, SIZES, Places
from hive_lab.bench.allocation.measure import Ratios
from hive_lab.bench.allocation.plans import figures, mean_and_worst, searched
from hive_lab.bench.allocation.reference import OBJECTIVES, best_of, read_best
from hive_lab.bench.allocation.running import Run, TabledLengths, moves_in, run_hive


def test_a_plan_is_told_by_its_way_its_end_and_its_times_to_done():
    instance = on_a_road(robots=[0.0, 10.0], starts=[2.0, 4.0, 11.0])

    found = figures(instance, ((0, 1), (2,)))

    assert found["energy"] == pytest.approx(2 + 2 + 1)
    assert found["makespan"] == pytest.approx(4.0)
    assert found["latency"] == pytest.approx((2 + 4 + 1) / 3)
    assert found["p95"] == pytest.approx(np.percentile([2, 4, 1], 95))


def test_a_plan_that_leaves_a_task_out_is_not_measured():
    instance = on_a_road(robots=[0.0], starts=[2.0, 4.0])

    with pytest.raises(ValueError, match="1 tasks on the lists, 2 to be given out"):
        figures(instance, ((0,),))


def test_the_search_reaches_the_optimum_of_a_small_instance():
    instance = on_a_road(robots=[0.0, 20.0], starts=[1.0, 3.0, 15.0, 18.0, 9.0])

    for objective in OBJECTIVES:
        how, best = best_of(instance, objective)
        plan = searched(instance, objective, 2000)

        assert how == "exact"
        assert figures(instance, plan)[objective] == pytest.approx(best)


def test_ratios_are_told_by_mean_and_worst():
    assert mean_and_worst("r", [1.0, 1.5]) == {"r mean": 1.25, "r worst": 1.5}


def test_every_rule_is_measured_against_the_best_which_none_can_beat():
    instance = on_a_road(robots=[0.0, 20.0], starts=[1.0, 3.0, 15.0, 18.0, 9.0])
    best = {objective: best_of(instance, objective)[1] for objective in OBJECTIVES}
    ratios = Ratios(SIZES[0])

    ratios.add_rules(instance, best)

    found = ratios.figures()
    for way in ("nearest", "report", "soonest", "hungarian"):
        for figure in ("latency", "makespan"):
            assert found[f"3x10 {way}: {figure} mean"] >= 1 - 1e-9


ROOM = Places(
    [Pose(0.0, 0.1), Pose(9.0, 0.2)],
    [Pose(1.0, 0.3), Pose(8.0, 0.4), Pose(2.0, 0.5)],
    [Pose(3.0, 0.6), Pose(5.0, 0.7), Pose(2.5, 0.8)],
    np.array(
        [
            *([2.0, 5.0, 1.0], [4.0, 3.0, 3.0], [1.5, 5.5, 0.5]),
            *([0.0, 7.0, 1.0], [7.0, 0.0, 6.0], [1.0, 6.0, 0.0]),
            *([1.0, 8.0, 2.0], [8.0, 1.0, 7.0]),
        ]
    ),
)
"""Two robots and three tasks along a road of 9 m; it is so narrow that only x counts."""


@pytest.mark.parametrize("decision", DECISIONS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_running_hive_does_every_task_and_none_faster_than_the_optimum(decision, kind):
    run = run_hive(ROOM, kind, "latency", BlackboardSettings(decision=decision))
    best = optimum(ROOM.instance(kind), "latency") / 3

    assert run.done.mean() >= best - 1e-6
    assert run.done.mean() == pytest.approx(best, abs=2.0)
    assert np.isfinite(run.first).all()
    assert run.way >= optimum(ROOM.instance(kind), "energy") - 1e-6
    assert (run.given, run.returned) == (3, 0)


def test_tasks_that_move_or_come_back_are_told_for_a_hundred():
    ratios = Ratios(SIZES[0])
    best = dict.fromkeys(OBJECTIVES, 10.0)
    for given, returned in ((10, 0), (14, 1)):
        ratios.add_run(
            "planned, latency",
            Run(np.full(10, 12.0), 20.0, 0, np.zeros(10), 11.0, given, returned, 0.5),
            best,
        )

    found = ratios.figures()
    assert found["3x10 planned, latency, moves per 100 tasks"] == pytest.approx(20.0)
    assert found["3x10 planned, latency, A-B-A per 100 tasks"] == pytest.approx(5.0)
    assert found["3x10 planned, latency: energy mean"] == pytest.approx(1.1)


def test_only_a_task_that_comes_back_counts_as_returned():
    chains = [["a", "a", "b"], ["a", "b", "b", "a"], ["c"]]

    assert moves_in(chains) == (2 + 3 + 1, 1)


def test_a_hive_is_told_of_each_task_when_it_is_posted():
    run = run_hive(ROOM, "go", "latency", BlackboardSettings(), [0.0, 30.0, 60.0])

    assert run.makespan > 60.0
    assert run.done.max() < 10.0


def test_a_part_of_the_places_keeps_their_distances():
    part = ROOM.part(1, 2)

    assert part.instance("go").way.tolist() == [[0.0, 7.0], [7.0, 0.0], [1.0, 8.0]]


def test_the_table_knows_the_best_of_every_instance():
    best = read_best()

    names = {
        f"{size.name}/{kind}/{seed}"
        for size in SIZES
        for kind in KINDS
        for seed in range(size.seeds)
    }
    assert set(best) == names
    assert all(set(found) == set(OBJECTIVES) for found in best.values())


@pytest.mark.parametrize("kind", KINDS)
def test_a_first_plan_is_measured_from_the_last_task_until_one_is_given_out(kind):
    hall = GridMap.of_blocked(np.zeros((20, 200), dtype=bool), 0.05)
    gathered, planned = first_plan(ROOM, kind, GridPathLengths(hall, 0.0))

    assert gathered > 0.0
    assert planned > 0.0


def test_a_robot_that_is_seen_exactly_at_a_place_is_there():
    here, there = Pose(0.0, 0.0), Pose(4.0, 0.0)
    lengths = TabledLengths([here, there], 2, np.array([[0.0, 4.0], [4.0, 0.0]]))
    lengths.set_out(there, there, 0.0)
    lengths.set_out(Pose(1.0, 0.0), there, 3.0)

    assert lengths.length(there, here) == 4.0
    assert lengths.length(Pose(1.0, 0.0), here) == 7.0
