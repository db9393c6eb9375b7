# SPDX-License-Identifier: BSD-3-Clause
"""What one robot bids, and every reason for which it bids MAX_COST."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blackboard.costing.bidding import Bidder
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.costing.schedule import Schedule
from blackboard.domain.battery import Battery
from blackboard.domain.bid import MAX_COST
from blackboard.domain.record import Order
from blackboard.domain.task import Task, TaskType
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

HERE = Pose(0.0, 0.0)
GO = Task("T1", TaskType.GA, (Pose(12.0, 0.0),))
# 12 m: 0.02 * 50 kg * 9.80665 m/s² * 12 m + 20 s * 20 W = 517.68 J, at 28 V in Ah.
GO_CHARGE = 517.6798 / (3600.0 * 28.0)


def bid(
    task,
    *,
    robot=SMALL_ROBOT,
    charge=1.0,
    before=(),
    model="report",
    path_lengths=None,
    here=HERE,
    at_work=False,
):
    """Return what a robot bids that has some tasks on its schedule already."""
    schedule = Schedule(robot, path_lengths or EuclideanLengths(), model)
    for earlier in before:
        schedule.insert(Order(earlier, "robot1"), here, keep_first=at_work)
    battery = Battery(robot.battery, charge)
    bidder = Bidder("robot1", robot, battery, schedule, COST_MODELS[model])
    return bidder.bid(task, 0, here, at_work=at_work)


def halved():
    """Return path lengths on a floor of 10 m x 10 m from (-5, -5), cut in two along x = 0.5 m."""
    blocked = np.zeros((100, 100), dtype=bool)
    blocked[:, 54:56] = True
    return GridPathLengths(GridMap.of_blocked(blocked, 0.1, Pose(-5.0, -5.0)), 0.3)


def test_an_idle_robot_bids_what_the_task_takes_of_its_charge():
    offer = bid(GO)

    # 1000 * Ce * 1 / 20 Ah.
    assert offer.cost == pytest.approx(1000.0 * GO_CHARGE / 20.0)
    assert offer.energy_cost == pytest.approx(GO_CHARGE)
    assert offer.eta == pytest.approx(20.0)
    assert (offer.robot_id, offer.task_id, offer.reason) == ("robot1", "T1", "")


def test_behind_another_task_the_place_doubles_the_cost_and_less_charge_is_left():
    earlier = Task("T0", TaskType.GA, (Pose(12.0, 0.0),), priority=5)
    back = Task("T1", TaskType.GA, (Pose(0.0, 0.0),))

    offer = bid(back, before=[earlier], at_work=True)

    # Both drives are 12 m long; the second begins with the charge that the first has left.
    assert offer.cost == pytest.approx(1000.0 * GO_CHARGE * 2 / (20.0 - GO_CHARGE))
    assert offer.eta == pytest.approx(40.0)


def test_by_energy_earlier_tasks_only_reduce_the_charge_that_is_left():
    earlier = Task("T0", TaskType.GA, (Pose(12.0, 0.0),), priority=5)
    back = Task("T1", TaskType.GA, (Pose(0.0, 0.0),))

    offer = bid(back, before=[earlier], at_work=True, model="energy")

    assert offer.cost == pytest.approx(1000.0 * GO_CHARGE / (20.0 - GO_CHARGE))


def test_by_latency_a_short_task_goes_first_and_costs_what_it_delays_the_other_too():
    long = Task("T0", TaskType.GA, (Pose(-60.0, 0.0),))

    offer = bid(GO, before=[long], model="latency")

    # 20 s to 12 m; the other one, 60 m the other way, is done 2 x 20 s later.
    assert offer.eta == pytest.approx(20.0)
    assert offer.cost == pytest.approx(1000.0 * 60.0 / (60.0 + 3600.0))


def test_by_makespan_a_task_costs_the_time_until_all_is_done():
    far = Task("T0", TaskType.GA, (Pose(60.0, 0.0),))

    on_the_way = bid(GO, before=[far], model="makespan")
    idle = bid(GO, model="makespan")

    assert on_the_way.cost == pytest.approx(1000.0 * 100.0 / (100.0 + 3600.0))
    assert idle.cost == pytest.approx(1000.0 * 20.0 / (20.0 + 3600.0))


def test_an_urgent_task_is_bid_for_as_the_next_one():
    waiting = Task("T0", TaskType.GA, (Pose(-12.0, 0.0),), priority=1)

    urgent = bid(replace(GO, priority=9), before=[waiting])

    assert urgent.cost == pytest.approx(bid(GO).cost)


@pytest.mark.parametrize(
    ("task", "robot", "reason"),
    [
        (replace(GO, payload=21.0), SMALL_ROBOT, "carries at most 20 kg, not 21 kg"),
        (
            Task("T1", TaskType.GPA, (HERE,)),
            replace(SMALL_ROBOT, capabilities=frozenset({TaskType.GA})),
            "does not do GPA",
        ),
        (
            Task("T1", TaskType.GPA, (HERE,), payload=6.0),
            SMALL_ROBOT,
            "its arm lifts at most 5 kg, not 6 kg",
        ),
    ],
)
def test_what_a_robot_can_never_do_costs_the_most_and_says_why(task, robot, reason):
    offer = bid(task, robot=robot)

    assert (offer.cost, offer.reason) == (MAX_COST, reason)
    assert not offer.is_able


def test_a_low_battery_refuses_what_would_take_it_below_a_tenth():
    offer = bid(GO, charge=0.1001)

    assert offer.cost == MAX_COST
    assert offer.reason == "its charge could fall to 10%; it keeps 10%"


def test_a_battery_just_above_the_tolerance_still_bids():
    most = 1.6 * 517.6798 / (3600.0 * Battery(SMALL_ROBOT.battery, 0.101).get_volts()) / 20.0

    assert not bid(GO, charge=0.1 + 0.99 * most).is_able
    assert bid(GO, charge=0.1 + 1.01 * most).is_able


def test_earlier_tasks_count_for_the_charge_at_the_time_of_execution():
    there = Task("T0", TaskType.GA, (Pose(6.0, 0.0),), priority=9)
    most = 1.6 * 517.6798 / (3600.0 * Battery(SMALL_ROBOT.battery, 0.101).get_volts()) / 20.0
    charge = 0.1 + 1.2 * most

    assert bid(GO, charge=charge).is_able
    assert not bid(replace(GO, goals=(Pose(-6.0, 0.0),)), charge=charge, before=[there]).is_able


def test_a_goal_without_a_path_is_refused_with_the_radius_that_does_not_fit():
    offer = bid(replace(GO, goals=(Pose(3.0, 0.0),)), path_lengths=halved(), here=Pose(-2.0, 0.0))

    assert offer.cost == MAX_COST
    assert offer.reason == "finds no path there from (-2.00, 0.00) for its radius of 0.30 m"


def test_behind_a_task_without_a_path_nothing_is_promised():
    lost = Task("T0", TaskType.GA, (Pose(3.0, 0.0),), priority=9)

    offer = bid(
        replace(GO, goals=(Pose(3.0, 2.0),)),
        path_lengths=halved(),
        here=Pose(-2.0, 0.0),
        before=[lost],
    )

    assert offer.cost == MAX_COST
    assert "no path" in offer.reason


def test_a_cost_at_the_end_of_the_scale_is_a_refusal():
    class Dear:
        """A cost model with an unusual idea of money."""

        def cost(self, terms):
            return MAX_COST + terms.place

    schedule = Schedule(SMALL_ROBOT, EuclideanLengths())
    bidder = Bidder("robot1", SMALL_ROBOT, Battery(SMALL_ROBOT.battery), schedule, Dear())

    offer = bidder.bid(GO, 0, HERE, at_work=False)

    assert (offer.cost, offer.reason) == (MAX_COST, "its cost of 1001 is not below 1000")


def test_steps_that_are_done_cost_nothing():
    task = Task("T1", TaskType.GAB, (Pose(12.0, 0.0), Pose(12.0, 5.0)))
    schedule = Schedule(SMALL_ROBOT, EuclideanLengths())
    model = COST_MODELS["report"]
    bidder = Bidder("robot1", SMALL_ROBOT, Battery(SMALL_ROBOT.battery), schedule, model)

    rest = bidder.bid(task, 1, Pose(12.0, 0.0), at_work=False)

    assert rest.eta == pytest.approx(5.0 / 0.6)
    assert math.isfinite(rest.cost)
