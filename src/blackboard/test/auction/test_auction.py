# SPDX-License-Identifier: BSD-3-Clause
"""One round of bidding."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.auction.auction import Auction
from blackboard.costing.bid_basis import Bids
from blackboard.domain.bid import MAX_COST, Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from hive_common.pose import Pose


def record(name, priority=0, tried=()):
    """Return the record of a task that waits."""
    task = Task(name, TaskType.GA, (Pose(1.0, 1.0),), priority)
    return TaskRecord(task, tried=tried)


def answer(robot, number=1, epoch=1, round_=1, **costs):
    """Return a robot's bids by task; MAX_COST comes with a reason."""
    bids = tuple(
        Bid(robot, name, cost, eta=10.0, reason="too far" if cost == MAX_COST else "")
        for name, cost in costs.items()
    )
    return Bids(robot, epoch, number, bids, round_)


def auction(*records, expected=("robot1", "robot2")):
    """Return an open auction in its first round."""
    return next_round(Auction(1, 1), records, *expected)


def next_round(round_, records, *asked):
    """Return an auction in its next round, in which each task is offered alone."""
    return round_.next_round(records, frozenset(asked), frozenset(asked))


def bid_in(round_, *answers):
    """Return an auction in which answers have been heard, none of which is refused."""
    for each in answers:
        round_, refusal = round_.hear(each)
        assert not refusal
    return round_


def forget_winners(round_):
    """Return an auction whose winners have to bid again."""
    for bid in round_.result().awards:
        round_ = round_.forget(bid.robot_id)
    return round_


def winners(round_):
    """Return the winner of each task that has one."""
    return {bid.task_id: bid.robot_id for bid in round_.result().awards}


def test_the_cheapest_robot_gets_the_task():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=20.0), answer("robot2", T1=10.0))

    assert winners(round_) == {"T1": "robot2"}


def test_an_auction_waits_for_robots_that_have_not_answered():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=20.0))

    assert round_.missing == {"robot2"}


def test_a_robot_that_was_not_asked_may_bid_as_well():
    round_ = auction(record("T1"), expected=["robot1"])
    round_ = bid_in(round_, answer("robot9", T1=1.0))

    assert winners(round_) == {"T1": "robot9"}
    assert round_.missing == {"robot1"}


def test_each_robot_gets_one_task_and_the_most_urgent_is_awarded_first():
    round_ = auction(record("low", 1), record("high", 9))
    round_ = bid_in(round_, answer("robot1", low=1.0, high=5.0))

    assert winners(round_) == {"high": "robot1"}
    assert not round_.result().impossible


def test_among_equal_priorities_the_best_pair_is_awarded_first():
    round_ = auction(record("first", 5), record("second", 5))
    round_ = bid_in(round_, answer("robot1", first=9.0, second=1.0))

    assert winners(round_) == {"second": "robot1"}


def test_a_task_that_one_robot_can_do_is_awarded_before_one_that_several_can():
    round_ = auction(record("light"), record("heavy"))
    round_ = bid_in(
        round_, answer("robot1", light=1.0, heavy=5.0), answer("robot2", light=2.0, heavy=MAX_COST)
    )

    assert winners(round_) == {"heavy": "robot1"}


def test_among_equal_bids_the_first_posted_is_awarded_first():
    round_ = auction(record("first", 5), record("second", 5))
    round_ = bid_in(round_, answer("robot1", first=1.0, second=1.0))

    assert winners(round_) == {"first": "robot1"}


def test_a_task_waits_for_the_next_bid_of_the_robot_that_is_best_for_it():
    round_ = auction(record("T1"), record("T2"))
    round_ = bid_in(round_, answer("robot1", T1=1.0, T2=2.0), answer("robot2", T1=8.0, T2=9.0))

    assert winners(round_) == {"T1": "robot1"}
    assert not round_.result().impossible


def test_only_the_winner_bids_again_and_the_bids_of_the_others_still_hold():
    tasks = [record("T1"), record("T2")]
    round_ = auction(*tasks)
    round_ = bid_in(round_, answer("robot1", T1=1.0, T2=2.0), answer("robot2", T1=8.0, T2=9.0))
    round_ = forget_winners(round_)

    round_ = next_round(round_, tasks[1:], "robot1", "robot2")
    assert round_.missing == {"robot1"}
    assert not round_.is_new

    round_ = bid_in(round_, answer("robot1", round_=2, T2=10.0))
    assert not round_.missing
    assert winners(round_) == {"T2": "robot2"}


def test_bids_for_the_schedule_before_a_win_are_refused():
    tasks = [record("T1"), record("T2")]
    round_ = auction(*tasks, expected=["robot1"])
    round_ = bid_in(round_, answer("robot1", T1=1.0, T2=2.0))
    round_ = forget_winners(round_)
    round_ = next_round(round_, tasks[1:], "robot1")

    round_, refusal = round_.hear(answer("robot1", T1=1.0, T2=2.0))

    assert re.search("answers auction 1/1/1, it was asked in 1/1/2", refusal)
    assert round_.missing == {"robot1"}


def test_all_robots_bid_when_a_task_is_new():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=1.0), answer("robot2", T1=2.0))
    round_ = forget_winners(round_)

    round_ = next_round(round_, [record("T2")], "robot1", "robot2")

    assert round_.is_new
    assert round_.missing == {"robot1", "robot2"}


def test_a_robot_whose_schedule_has_changed_bids_again():
    tasks = [record("T1"), record("T2")]
    round_ = auction(*tasks, expected=["robot1", "robot2", "robot3"])
    for robot, cost in (("robot1", 1.0), ("robot2", 2.0), ("robot3", 3.0)):
        round_ = bid_in(round_, answer(robot, T1=cost, T2=cost))
    round_ = forget_winners(round_)
    round_ = round_.forget("robot2")

    round_ = next_round(round_, tasks[1:], "robot1", "robot2", "robot3")

    assert round_.missing == {"robot1", "robot2"}


def test_bids_of_a_robot_that_left_service_do_not_win():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=1.0), answer("robot2", T1=2.0))
    round_ = round_.close(frozenset({"robot2"}))

    assert winners(round_) == {"T1": "robot2"}


def test_slow_robots_are_waited_for_only_if_nobody_else_bids():
    round_ = auction(record("T1"))
    round_ = round_.excuse(frozenset({"robot2"}))
    assert round_.missing == {"robot1"}

    round_ = round_.excuse(frozenset({"robot1", "robot2"}))
    assert round_.missing == {"robot1"}


def test_two_robots_get_two_tasks_in_one_round():
    round_ = auction(record("T1"), record("T2"))
    round_ = bid_in(round_, answer("robot1", T1=1.0, T2=4.0), answer("robot2", T1=2.0, T2=3.0))

    assert winners(round_) == {"T1": "robot1", "T2": "robot2"}
    assert not round_.result().impossible


def test_a_robot_that_has_handed_the_task_back_comes_last():
    round_ = auction(record("T1", tried=("robot1",)))
    round_ = bid_in(round_, answer("robot1", T1=1.0), answer("robot2", T1=900.0))

    assert winners(round_) == {"T1": "robot2"}


def test_a_robot_that_has_handed_the_task_back_gets_it_if_nobody_else_can():
    round_ = auction(record("T1", tried=("robot1",)))
    round_ = bid_in(round_, answer("robot1", T1=1.0), answer("robot2", T1=MAX_COST))

    assert winners(round_) == {"T1": "robot1"}


def test_equal_bids_are_decided_by_name():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot2", T1=5.0), answer("robot1", T1=5.0))

    assert winners(round_) == {"T1": "robot1"}


def test_a_task_that_nobody_can_take_has_a_reason_for_every_robot():
    round_ = auction(record("T1"), record("T2"), expected=("robot1", "robot2", "robot3"))
    round_ = bid_in(round_, answer("robot1", T1=MAX_COST, T2=MAX_COST), answer("robot2", T2=1.0))

    assert round_.result().impossible == (
        (
            "T1",
            (
                "nobody can take it now: robot1: too far; robot2: has made no valid bid; "
                "robot3: has not answered"
            ),
        ),
    )


def test_a_robot_out_of_service_that_says_nothing_of_a_task_is_not_among_the_reasons():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=MAX_COST), answer("robot2"))
    round_ = round_.close(frozenset({"robot1"}))

    assert round_.result().impossible == (("T1", "nobody can take it now: robot1: too far"),)


def test_a_robot_that_does_not_answer_again_is_named_once_among_the_reasons():
    tasks = [record("T1"), record("T2")]
    round_ = auction(*tasks, expected=["robot1"])
    round_ = forget_winners(bid_in(round_, answer("robot1", T1=1.0, T2=2.0)))
    round_ = next_round(round_, tasks[1:], "robot1")

    (_, reason), *_ = round_.result().impossible

    assert reason == "nobody can take it now: robot1: has not answered"


def test_a_second_answer_is_refused_and_the_first_still_holds():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=3.0))

    round_, refusal = round_.hear(answer("robot1", T1=1.0))

    assert re.search("robot1 answers twice", refusal)
    assert [bid.cost for bid in round_.result().awards] == [3.0]


def test_the_same_answer_again_is_harmless():
    round_ = auction(record("T1"))
    round_ = bid_in(round_, answer("robot1", T1=3.0), answer("robot1", T1=3.0))

    assert winners(round_) == {"T1": "robot1"}


def test_two_bids_on_one_task_are_refused():
    round_ = auction(record("T1"))
    bid = Bid("robot1", "T1", 1.0, eta=10.0)

    round_, refusal = round_.hear(Bids("robot1", 1, 1, (bid, bid)))

    assert re.search("robot1 bids twice on one task", refusal)
    assert not winners(round_)


def test_a_withdrawn_task_is_not_awarded_and_bids_on_it_do_no_harm():
    round_ = auction(record("T1"), record("T2"))
    round_ = round_.withdraw(frozenset({"T1"}))
    round_ = bid_in(round_, answer("robot1", T1=1.0, T2=2.0))

    assert winners(round_) == {"T2": "robot1"}


@pytest.mark.parametrize(("epoch", "number"), [(1, 2), (2, 1), (0, 1)])
def test_an_answer_to_another_auction_is_refused(epoch, number):
    round_ = auction(record("T1"))

    round_, refusal = round_.hear(answer("robot1", number, epoch, T1=1.0))

    assert re.search(f"answers auction {epoch}/{number}/1, it was asked", refusal)
    assert round_.missing == {"robot1", "robot2"}
    assert not winners(round_)


@pytest.mark.parametrize("cost", [math.nan, -0.001, 1000.001, math.inf, -math.inf])
def test_a_bid_whose_cost_is_out_of_range_is_refused_with_the_whole_answer(cost):
    round_ = auction(record("T1"), record("T2"))

    round_, refusal = round_.hear(answer("robot1", T1=1.0, T2=cost))

    assert re.search(r"robot1 bids .* on T2; allowed: from 0 to 1000", refusal)
    assert not winners(round_)


@pytest.mark.parametrize("eta", [math.nan, -1.0, math.inf])
def test_a_bid_without_a_finite_duration_is_refused(eta):
    round_ = auction(record("T1"))

    round_, refusal = round_.hear(Bids("robot1", 1, 1, (Bid("robot1", "T1", 1.0, eta=eta),)))

    assert re.search("robot1 would have T1 done in", refusal)
    assert not winners(round_)


def test_a_bid_on_a_task_that_is_not_offered_is_refused():
    round_ = auction(record("T1"))

    round_, refusal = round_.hear(answer("robot1", T1=1.0, T9=1.0))

    assert re.search("robot1 bids on 'T9': not offered", refusal)
    assert not winners(round_)


def test_bids_without_a_robot_are_refused():
    round_ = auction(record("T1"))

    round_, refusal = round_.hear(answer("", T1=1.0))

    assert re.search("robot_id says who bids", refusal)
    assert not winners(round_)


def test_a_robot_whose_answer_was_refused_is_not_waited_for():
    round_ = auction(record("T1"), expected=["robot1"])

    round_, refusal = round_.hear(answer("robot1", T1=math.nan))

    assert refusal
    assert not round_.missing
    assert round_.result().impossible[0][1].endswith("robot1: has made no valid bid")


COSTS = st.dictionaries(
    st.sampled_from(["robot1", "robot2", "robot3"]),
    st.lists(st.floats(0.0, MAX_COST), min_size=4, max_size=4),
)


@given(COSTS, st.lists(st.integers(0, 10), min_size=4, max_size=4))
def test_whatever_the_bids_each_task_is_awarded_once_or_left_for_a_good_reason(costs, priorities):
    names = [f"T{number}" for number in range(4)]
    round_ = auction(*map(record, names, priorities), expected=list(costs))
    for robot, bids in costs.items():
        round_ = bid_in(round_, answer(robot, **dict(zip(names, bids, strict=True))))

    result = round_.result()

    given_to = [bid.robot_id for bid in result.awards]
    assert len(set(given_to)) == len(given_to)
    assert all(bid.is_able for bid in result.awards)
    assert not {bid.task_id for bid in result.awards} & {name for name, _ in result.impossible}
    for name, _ in result.impossible:
        assert all(bids[names.index(name)] == MAX_COST for bids in costs.values())
    if any(cost < MAX_COST for bids in costs.values() for cost in bids):
        assert result.awards
