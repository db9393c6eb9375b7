# SPDX-License-Identifier: BSD-3-Clause
"""What `./hive bench allocation` makes of plans, on instances small enough to check by hand."""

import numpy as np
import pytest

from hive_lab.allocation.testing import on_a_road
from hive_lab.bench.allocation.instances import KINDS, SIZES
from hive_lab.bench.allocation.measure import Ratios
from hive_lab.bench.allocation.plans import figures, mean_and_worst, searched
from hive_lab.bench.allocation.reference import OBJECTIVES, best_of, read_best


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
        plan = searched(instance, objective, None, 0.2)

        assert how == "exact"
        assert figures(instance, plan)[objective] == pytest.approx(best)


def test_ratios_are_told_by_mean_and_worst():
    assert mean_and_worst("r", [1.0, 1.5]) == {"r mean": 1.25, "r worst": 1.5}


def test_every_rule_is_measured_against_the_best_and_the_search_is_never_better_than_exact():
    instance = on_a_road(robots=[0.0, 20.0], starts=[1.0, 3.0, 15.0, 18.0, 9.0])
    best = {objective: best_of(instance, objective)[1] for objective in OBJECTIVES}
    ratios = Ratios(SIZES[0])

    ratios.add("3x10/go/0", instance, best)

    found = ratios.figures()
    assert found["3x10 search latency: latency worst"] == pytest.approx(1.0)
    for way in ("nearest", "report", "soonest", "hungarian", "auction energy"):
        assert all(found[f"3x10 {way}: {objective} mean"] >= 1 - 1e-9 for objective in OBJECTIVES)


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
