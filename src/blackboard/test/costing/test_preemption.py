# SPDX-License-Identifier: BSD-3-Clause
"""Who is interrupted for a task of the highest priority, and what that costs."""

from dataclasses import replace

import pytest

from blackboard.costing.bidding import Bidder
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.preemption import best_bid, may_put_off
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.battery import Battery
from blackboard.domain.bid import MAX_COST, Bid
from blackboard.domain.record import Order, TaskRecord
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

HERE, A, B = Pose(0.0, 0.0), Pose(10.0, 0.0), Pose(20.0, 0.0)
URGENT = Task("U", TaskType.GA, (A,), priority=10)
LESSER = Task("L", TaskType.GAB, (A, B), priority=9)
CARRY = Task("C", TaskType.GPAB, (A, B), payload=2.0)


def entry(task, step=0):
    return Entry(Order(task, "robot1"), step)


def wins(*bids, tried=(), task=URGENT):
    winner = best_bid(TaskRecord(task, tried=tried), bids)
    return winner and winner.robot_id


def idle(robot, cost):
    return Bid(robot, "U", cost)


def busy(robot, cost, interrupt_cost=MAX_COST):
    return Bid(robot, "U", cost, under_way="L", interrupt_cost=interrupt_cost)


def interrupt_cost(
    urgent, under_way, *, step=0, here=HERE, model="energy", at_work=True, charge=1.0
):
    """Return what a robot bids for interrupting what it is doing."""
    schedule = Schedule(SMALL_ROBOT, EuclideanLengths())
    schedule.insert(Order(under_way, "robot1", step=step), here, keep_first=False)
    battery = Battery(SMALL_ROBOT.battery, charge)
    bidder = Bidder("robot1", SMALL_ROBOT, battery, schedule, COST_MODELS[model])
    return bidder.bid(urgent, 0, here, at_work=at_work).interrupt_cost


def test_only_the_highest_priority_interrupts_others():
    assert may_put_off(entry(LESSER), URGENT)
    assert not may_put_off(entry(LESSER), replace(URGENT, priority=9))
    assert not may_put_off(entry(replace(LESSER, priority=0)), replace(URGENT, priority=9))


def test_the_highest_priority_never_interrupts_itself():
    assert not may_put_off(entry(replace(LESSER, priority=10)), URGENT)


@pytest.mark.parametrize(("step", "may"), [(0, True), (1, False), (2, False), (3, False)])
def test_a_robot_that_picks_or_carries_is_not_interrupted(step, may):
    assert may_put_off(entry(CARRY, step), URGENT) is may


def test_a_robot_that_carries_what_people_loaded_is_not_interrupted():
    assert not may_put_off(entry(replace(LESSER, payload=3.0)), URGENT)


def test_a_robot_that_can_begin_at_once_goes_before_a_cheaper_one_that_is_busy():
    assert wins(idle("robot1", 50.0), busy("robot2", 1.0, 2.0)) == "robot1"


def test_the_cheapest_of_those_that_can_begin_at_once_wins():
    assert wins(idle("robot1", 50.0), idle("robot2", 40.0), busy("robot3", 1.0)) == "robot2"


def test_where_all_are_busy_the_one_that_costs_least_to_interrupt_wins():
    assert wins(busy("robot1", 1.0, 30.0), busy("robot2", 9.0, 20.0)) == "robot2"


def test_where_nobody_may_be_interrupted_the_cheapest_wins():
    assert wins(busy("robot1", 9.0), busy("robot2", 8.0)) == "robot2"


def test_robots_that_have_tried_it_in_vain_come_last_even_where_they_are_idle():
    bids = idle("robot1", 1.0), busy("robot2", 9.0, 30.0)

    assert wins(*bids, tried=("robot1",)) == "robot2"


def test_below_the_highest_priority_only_the_cost_counts():
    bids = idle("robot1", 50.0), busy("robot2", 2.0, 1.0)

    assert wins(*bids, task=replace(URGENT, priority=9)) == "robot2"


def test_without_bids_nobody_wins():
    assert wins() is None


def test_a_detour_costs_what_it_is_longer():
    on_the_way = interrupt_cost(URGENT, replace(LESSER, goals=(B, B)))
    behind = interrupt_cost(replace(URGENT, goals=(Pose(-10.0, 0.0),)), LESSER)

    assert on_the_way == pytest.approx(0.0, abs=1e-9)
    assert behind > on_the_way


def test_it_costs_the_urgent_drive_and_the_drive_back():
    one_way = interrupt_cost(replace(URGENT, goals=(Pose(-10.0, 0.0),)), LESSER)
    twice = interrupt_cost(replace(URGENT, goals=(Pose(-20.0, 0.0),)), LESSER)

    assert twice == pytest.approx(2 * one_way, rel=1e-3)


def test_what_has_been_done_of_the_other_task_is_not_counted_again():
    near_b = Pose(19.0, 0.0)

    assert interrupt_cost(URGENT, LESSER, step=1, here=near_b) == pytest.approx(
        interrupt_cost(URGENT, replace(LESSER, goals=(B, B)), here=near_b), rel=1e-6
    )


@pytest.mark.parametrize("model", COST_MODELS)
def test_by_every_cost_model_a_longer_detour_costs_more(model):
    near = interrupt_cost(replace(URGENT, goals=(Pose(-10.0, 0.0),)), LESSER, model=model)
    far = interrupt_cost(replace(URGENT, goals=(Pose(-20.0, 0.0),)), LESSER, model=model)

    assert 0.0 < near < far < MAX_COST


def test_a_robot_that_is_free_has_nothing_to_interrupt():
    assert interrupt_cost(URGENT, LESSER, at_work=False) == MAX_COST


def test_a_robot_whose_battery_cannot_do_both_is_not_interrupted():
    far = replace(URGENT, goals=(Pose(-3e4, 0.0),))

    assert interrupt_cost(replace(URGENT, goals=(Pose(-10.0, 0.0),)), LESSER) < MAX_COST
    assert interrupt_cost(far, LESSER, charge=0.3) == MAX_COST


@pytest.mark.parametrize(("charge", "may"), [(0.165, False), (0.195, True)])
def test_the_charge_for_both_counts_with_the_margin_of_its_prediction(charge, may):
    """They take 5 % of the battery by the formula, and 8 % at most."""
    far = replace(URGENT, goals=(Pose(1020.0, 0.0),))

    cost = interrupt_cost(far, LESSER, step=1, here=Pose(19.9, 0.0), charge=charge)

    assert (cost < MAX_COST) is may
