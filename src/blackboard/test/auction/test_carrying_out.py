# SPDX-License-Identifier: BSD-3-Clause
"""What a plan asks for: awards, transfers and other places."""

from dataclasses import replace

import pytest

from blackboard.auction.carrying_out import steps_to
from blackboard.auction.search.offers import MOST
from blackboard.auction.search.planned import Place, Planned
from blackboard.domain.bid import MAX_COST, Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

FLEET = frozenset({"robot1", "robot2"})


def record(name, robot=""):
    """Return the record of a task that waits, or that a robot has and has not begun."""
    task = Task(name, TaskType.GA, (Pose(1.0, 0.0),))
    state = TaskState.ASSIGNED if robot else TaskState.WAITING
    return TaskRecord(task, state, robot)


def planned(*places, was=None, cost=50.0):
    """Return a plan of (record, robot, place), in which every task costs as much."""
    bids = [Bid(robot, each.task.id, cost, eta=5.0) for each, robot, _ in places]
    return Planned(tuple(map(Place, *zip(*places, strict=True), bids)), was=was or {})


def steps(plan, in_service=FLEET, others=None, **how):
    """Return what a plan asks for if nothing has changed since."""
    records = {each.record.task.id: each.record for each in plan.places}
    return steps_to(plan, records, in_service, others or {}, **how)


def bids(robot, **costs):
    """Return the bids of a robot that bids itself."""
    return {robot: {task_id: Bid(robot, task_id, cost) for task_id, cost in costs.items()}}


def test_what_waits_is_awarded_at_its_place():
    found = steps(planned((record("T1"), "robot2", 3)))

    assert [(bid.task_id, bid.robot_id, bid.eta) for bid in found.awards] == [
        ("T1", "robot2", 5.0)
    ]
    assert found.places == {"T1": 3}


def test_what_another_robot_has_is_moved():
    found = steps(planned((record("T1", "robot1"), "robot2", 2)))

    assert [(move.record.task.id, move.place) for move in found.moves] == [("T1", 2)]
    assert not found.awards


def test_a_list_in_the_order_of_the_plan_is_left_alone():
    first, second = record("T1", "robot1"), record("T2", "robot1")
    plan = planned((first, "robot1", 1), (second, "robot1", 2), was={"robot1": ("T1", "T2")})

    assert steps(plan).reorders == ()


def test_a_list_in_another_order_is_ordered_anew():
    first, second = record("T1", "robot1"), record("T2", "robot1")
    plan = planned((second, "robot1", 1), (first, "robot1", 2), was={"robot1": ("T1", "T2")})

    assert steps(plan).reorders == ((second, 1), (first, 2))


def test_what_has_changed_while_the_plan_was_made_is_left_out():
    plan = planned((record("T1"), "robot1", 1))
    changed = replace(plan.places[0].record, state=TaskState.CANCELLED)

    assert steps_to(plan, {"T1": changed}, FLEET, {}).awards == ()


def test_a_robot_that_has_left_service_gets_nothing():
    assert steps(planned((record("T1"), "robot1", 1)), frozenset({"robot2"})).awards == ()


def test_a_robot_that_bids_itself_gets_the_task_on_which_it_is_better_by_most():
    plan = planned((record("T1"), "robot1", 1), (record("T2"), "robot1", 2))

    found = steps(plan, others=bids("robot2", T1=49.0, T2=20.0))

    assert [(bid.task_id, bid.robot_id) for bid in found.awards] == [
        ("T1", "robot1"),
        ("T2", "robot2"),
    ]
    assert found.places == {"T1": 1}
    assert [bid.robot_id for bid in found.bids["T2"]] == ["robot1", "robot2"]


@pytest.mark.parametrize(("cost", "in_service"), [(50.0, FLEET), (20.0, {"robot1"})])
def test_a_robot_that_bids_more_or_is_out_of_service_gets_nothing(cost, in_service):
    plan = planned((record("T1"), "robot1", 1))

    found = steps(plan, frozenset(in_service), bids("robot2", T1=cost))

    assert [bid.robot_id for bid in found.awards] == ["robot1"]


def test_a_robot_that_bids_itself_gets_nothing_that_it_cannot_do_or_has_tried():
    tried = replace(record("T1"), tried=("robot2",))
    plan = planned((tried, "robot1", 1), (record("T2"), "robot1", 2), cost=MAX_COST)

    found = steps(plan, others=bids("robot2", T1=1.0, T2=MAX_COST))

    assert {bid.robot_id for bid in found.awards} == {"robot1"}


@pytest.mark.parametrize(("cost", "moves"), [(20.0, ["T1"]), (48.0, [])])
def test_what_a_robot_has_goes_to_one_that_bids_itself_if_that_pays_for_the_move(cost, moves):
    plan = planned((record("T1", "robot1"), "robot1", 1), was={"robot1": ("T1",)})

    found = steps(plan, others=bids("robot2", T1=cost), keeps_lists=True)

    assert [move.record.task.id for move in found.moves] == moves
    assert all(move.place == 0 for move in found.moves)


def test_of_a_plan_that_is_not_worth_its_moves_nothing_else_is_followed():
    plan = planned((record("T1", "robot1"), "robot2", 1))

    found = steps(plan, keeps_lists=True)

    assert (found.awards, found.moves, found.reorders) == ((), (), ())


def test_two_robots_that_bid_themselves_do_not_get_one_task():
    plan = planned((record("T1"), "robot1", 1))
    both = bids("robot2", T1=20.0) | bids("robot3", T1=10.0)

    found = steps(plan, FLEET | {"robot3"}, both)

    assert [bid.robot_id for bid in found.awards] == ["robot3"]


def test_a_robot_that_is_better_for_two_tasks_leaves_one_to_the_next_best():
    plan = planned((record("T1"), "robot1", 1), (record("T2"), "robot1", 2))
    both = bids("robot2", T1=10.0, T2=20.0) | bids("robot3", T1=15.0)

    found = steps(plan, FLEET | {"robot3"}, both)

    assert {bid.task_id: bid.robot_id for bid in found.awards} == {"T1": "robot2", "T2": "robot1"}


def test_places_close_up_where_a_task_that_waits_goes_to_a_robot_that_bids_itself():
    plan = planned(
        (record("N1"), "robot1", 1),
        (record("K1", "robot1"), "robot1", 2),
        (record("N2"), "robot1", 3),
        (record("K2", "robot1"), "robot1", 4),
        was={"robot1": ("K2", "K1")},
    )

    found = steps(plan, others=bids("robot2", N1=1.0))

    assert {name: found.places[name] for name in ("K1", "N2", "K2")} == {"K1": 1, "N2": 2, "K2": 3}
    assert [(each.task.id, place) for each, place in found.reorders] == [("K1", 1), ("K2", 3)]


def test_places_stay_where_a_task_on_the_list_goes_to_a_robot_that_bids_itself():
    plan = planned(
        (record("K1", "robot1"), "robot1", 1),
        (record("N1"), "robot1", 2),
        was={"robot1": ("K1",)},
    )

    assert steps(plan, others=bids("robot2", K1=1.0)).places == {"N1": 2}


def test_a_task_that_its_robot_does_not_list_yet_is_no_reason_to_order_its_list_anew():
    plan = planned((record("T1", "robot1"), "robot1", 1), was={"robot1": ()})

    assert steps(plan).reorders == ()


def test_of_many_robots_that_bid_themselves_the_best_bids_are_noted_and_that_of_the_winner():
    names = [f"robot{number}" for number in range(2, 3 + MOST)]
    both = [record("T1"), record("T2")]
    plan = planned(*((each, "robot1", place) for place, each in enumerate(both, start=1)))
    others = {}
    for number, name in enumerate(names):
        others |= bids(name, T1=float(number), T2=0.5)

    found = steps(plan, FLEET | set(names), others)

    assert all(len(found.bids[name]) <= 1 + MOST // 2 + 1 for name in ("T1", "T2"))
    assert all(bid in found.bids[bid.task_id] for bid in found.awards)
