# SPDX-License-Identifier: BSD-3-Clause
"""The physics by hand, and the cost models."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.costing.cost import COST_MODELS, friction_force
from blackboard.domain.bid import MAX_COST, Bid, CostTerms

TERMS = CostTerms(
    energy_charge=0.5, charge_left=10.0, place=2, way=20.0, eta=600.0, added_charge=0.3
)


def test_the_friction_force_is_coefficient_times_weight():
    # 0.02 * 100 kg * 9.80665 m/s² in N.
    assert friction_force(0.02, 100.0) == pytest.approx(19.6133)


def test_the_report_s_cost_is_the_charge_taken_over_the_charge_left_times_the_place():
    # 1000 * 0.5 Ah * 2 / 10 Ah.
    assert COST_MODELS["report"].cost(TERMS) == pytest.approx(100.0)


def test_by_the_report_an_idle_robot_is_not_free():
    first = replace(TERMS, place=1)

    assert COST_MODELS["report"].cost(first) == pytest.approx(50.0)


def test_by_energy_it_is_the_charge_that_the_schedule_takes_more_wherever_the_task_goes():
    model = COST_MODELS["energy"]

    # 1000 * 0.3 Ah / 10 Ah.
    assert model.cost(TERMS) == pytest.approx(30.0)
    assert model.cost(replace(TERMS, place=9)) == model.cost(TERMS)


def test_by_time_ten_minutes_are_half_of_the_scale():
    assert COST_MODELS["time"].cost(TERMS) == pytest.approx(500.0)


@given(st.floats(0.0, 1e6), st.floats(0.0, 1e6))
def test_by_time_the_sooner_is_the_cheaper_and_none_is_impossible(one, other):
    sooner, later = sorted((one, other))
    model = COST_MODELS["time"]

    assert model.cost(replace(TERMS, eta=sooner)) <= model.cost(replace(TERMS, eta=later))
    assert model.cost(replace(TERMS, eta=later)) < MAX_COST


@pytest.mark.parametrize("name", COST_MODELS)
@given(charge=st.floats(0.0, 5.0), left=st.floats(5.0, 50.0), place=st.integers(1, 20))
def test_no_model_gives_less_than_nothing(name, charge, left, place):
    terms = CostTerms(charge, left, place, way=1.0, eta=10.0)

    assert COST_MODELS[name].cost(terms) >= 0.0


def test_a_bid_of_the_highest_cost_means_that_the_robot_cannot():
    assert Bid("robot1", "T1", MAX_COST - 0.001).is_able
    assert not Bid("robot1", "T1", MAX_COST).is_able
