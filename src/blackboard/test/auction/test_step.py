# SPDX-License-Identifier: BSD-3-Clause
"""The auctioneer's steps: what each event leads to, without a network or a clock."""

import math
from dataclasses import replace

import pytest

from blackboard.auction.candidate_selection import CandidateSelection
from blackboard.auction.search.planned import Place, Planned
from blackboard.auction.step import (
    AuctionState,
    AwardsCommitted,
    BidsHeard,
    CarryOut,
    ImprovementDue,
    MakePlan,
    PlanMade,
    Recall,
    Refuse,
    RobotImproved,
    ScheduleChanged,
    SetTimer,
    Signal,
    View,
    Withdrawn,
    step,
)
from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from blackboard.domain.record import Broadcast, TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

BASIS = BidBasis(SMALL_ROBOT, "latency", 120.0, Pose(0.0, 0.0), 1.0)
ROUND, TRANSFERS = Signal.ROUND_TIMEOUT, Signal.TRANSFER_TIMEOUT


class Desk:
    """An auctioneer in a hive whose list and fleet a test changes at will."""

    def __init__(self, *robots, max_asked=50, plans=False):
        selection = CandidateSelection(max_asked, 4, 2000)
        self.state = AuctionState(2.0, 3.0, selection, plans=plans)
        self.records = {}
        self.robots = frozenset(robots)
        self.plans_made = 0

    def put(self, name, state=TaskState.WAITING, robot=""):
        task = Task(name, TaskType.GA, (Pose(1.0, 1.0),))
        before = self.records.get(name)
        number = before.assignment if before else int(bool(robot))
        self.records[name] = TaskRecord(task, state, robot, assignment=number)

    def say(self, event):
        view = View("hive1", 1, dict(self.records), self.robots, lambda _: None)
        self.state, effects = step(self.state, event, view)
        return effects

    def bid(self, robot, eta=10.0, **costs):
        bids = tuple(
            Bid(robot, name, cost, eta=eta, terms=CostTerms(1.0, 1.0, 1, cost, 10.0, cost, cost))
            for name, cost in costs.items()
        )
        call = self.state.call
        return self.say(BidsHeard(Bids(robot, call.epoch, call.auction, bids, call.round)))

    def auction(self, *tasks):
        """Put tasks on the list, and return the effects of auctioning them."""
        for name in tasks:
            self.put(name)
        return self.say(Signal.TASK_CAME)

    def improve(self):
        """Say that it is time to improve the lists."""
        return self.say(ImprovementDue(tuple(self.records.values())))

    def tell(self, *robots):
        """Have robots tell what their bids are made from; return what the last one leads to."""
        effects = []
        for robot in robots:
            call = self.state.call
            bids = Bids(robot, call.epoch, call.auction, (), call.round, BASIS)
            effects = self.say(BidsHeard(bids))
        return effects

    def plan(self, before=10.0, after=5.0, **takers):
        """Have a plan made that gives tasks to robots."""
        places = tuple(
            Place(self.records[name], robot, 1, Bid(robot, name, 5.0))
            for name, robot in takers.items()
        )
        return self.say(PlanMade(Planned(places, before=before, after=after)))

    def improved(self, *, times=1, **plan):
        """Have plans made of what robots hold; return what the last one leads to.

        `plans_made` counts those that were asked for.
        """
        effects = []
        for _ in range(times):
            self.improve()
            self.plans_made += kinds(self.tell("robot1", "robot2")).count(MakePlan)
            effects = self.plan(**plan)
        return effects

    def transfer(self):
        """Have a plan move T1 from robot1 to robot2."""
        self.put("T1", TaskState.ASSIGNED, "robot1")
        return self.improved(T1="robot2")


def kinds(effects):
    return [type(effect) for effect in effects]


def result(effects):
    """Return the result to be carried out, which is the last effect."""
    assert kinds(effects)[-1:] == [CarryOut]
    return effects[-1].result


def winners(effects):
    return {bid.task_id: bid.robot_id for bid in result(effects).awards}


def test_a_task_that_comes_opens_a_round_and_starts_its_timer():
    desk = Desk("robot1")

    timer, call = desk.auction("T1")

    assert timer == SetTimer(ROUND, 2.0)
    assert call == desk.state.call
    assert [task.id for task, _ in call.tasks] == ["T1"]
    assert call.asked is None


def test_nothing_is_asked_while_nothing_waits_or_an_auction_is_under_way():
    desk = Desk("robot1")

    assert desk.say(Signal.TASK_CAME) == []
    desk.auction("T1")
    assert desk.auction("T2") == []


def test_the_last_bid_closes_the_round_and_its_result_is_carried_out_last():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")

    assert desk.bid("robot1", T1=5.0) == []
    effects = desk.bid("robot2", T1=4.0)

    assert effects[0] == SetTimer(ROUND)
    assert winners(effects) == {"T1": "robot2"}


def test_the_timer_closes_a_round_once():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")
    desk.bid("robot1", T1=5.0)

    assert winners(desk.say(ROUND)) == {"T1": "robot1"}
    assert desk.say(ROUND) == []
    assert desk.state.slow == {"robot2"}


def test_nothing_new_is_asked_before_the_awards_are_committed():
    desk = Desk("robot1")
    desk.auction("T1", "T2")
    awards = result(desk.bid("robot1", T1=1.0, T2=2.0)).awards
    desk.put("T1", TaskState.ASSIGNED, "robot1")

    assert desk.say(Signal.TASK_CAME) == []
    _, call = desk.say(AwardsCommitted(awards))
    assert call.round == 2
    assert call.asked == {"robot1": "T1"}


def test_an_auction_ends_when_nothing_waits_any_more():
    desk = Desk("robot1")
    desk.auction("T1")
    awards = result(desk.bid("robot1", T1=1.0)).awards
    desk.put("T1", TaskState.ASSIGNED, "robot1")

    assert desk.say(AwardsCommitted(awards)) == []
    assert desk.state.auction is None


def test_bids_that_are_refused_are_said_and_close_no_round():
    desk = Desk("robot1")
    desk.auction("T1")

    (refusal,) = desk.bid("robot1", T1=-1.0)

    assert refusal == Refuse("robot1 bids -1 on T1; allowed: from 0 to 1000")


def test_an_answer_from_which_no_bids_can_be_worked_out_is_refused_and_still_waited_for():
    desk = Desk("robot1")
    desk.auction("T1")

    assert desk.say(BidsHeard(Bids("robot1", 1, 1, ()), "nonsense")) == [Refuse("nonsense")]
    assert desk.state.auction.missing == {"robot1"}


def test_what_nobody_can_take_is_parked_until_the_fleet_changes():
    desk = Desk("robot1")
    desk.auction("T1")
    effects = desk.bid("robot1", T1=MAX_COST)
    assert [name for name, _ in result(effects).impossible] == ["T1"]
    desk.say(AwardsCommitted(()))

    assert desk.say(Signal.TASK_CAME) == []
    assert kinds(desk.say(Signal.FLEET_CHANGED)) == [SetTimer, Broadcast]


def test_what_becomes_possible_while_an_auction_is_under_way_is_not_parked():
    desk = Desk("robot1")
    desk.auction("T1")
    desk.say(Signal.FLEET_CHANGED)
    desk.bid("robot1", T1=MAX_COST)

    assert desk.state.parked == frozenset()
    assert kinds(desk.say(AwardsCommitted(()))) == [SetTimer, Broadcast]
    assert desk.state.call.auction == 2


def test_a_robot_that_improves_is_asked_again_in_the_next_round():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")
    desk.bid("robot1", T1=MAX_COST)
    desk.say(RobotImproved("robot1"))
    desk.bid("robot2", T1=MAX_COST)

    _, call = desk.say(AwardsCommitted(()))

    assert call.asked == {"robot1": ""}


def test_a_robot_whose_schedule_changes_is_asked_again_and_its_bid_does_not_win():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")
    desk.bid("robot1", T1=1.0)
    desk.say(ScheduleChanged("robot1"))

    assert winners(desk.bid("robot2", T1=5.0)) == {"T1": "robot2"}


def test_what_is_withdrawn_is_not_awarded_and_not_parked():
    desk = Desk("robot1")
    desk.auction("T1", "T2")
    desk.say(Withdrawn(frozenset({"T1"})))

    decided = result(desk.bid("robot1", T1=1.0, T2=MAX_COST))

    assert not decided.awards
    assert [name for name, _ in decided.impossible] == ["T2"]
    desk.say(Withdrawn(frozenset({"T2"})))
    assert desk.state.parked == frozenset()


def test_without_a_robot_in_service_a_task_is_parked_with_that_reason():
    decided = result(Desk().auction("T1"))

    assert decided.impossible == (("T1", "no robot is in service"),)


def test_what_the_robots_asked_first_cannot_take_is_offered_to_all():
    desk = Desk("robot1", "robot2", max_asked=1)
    _, first = desk.auction("T1")
    decided = result(desk.bid("robot1", T1=MAX_COST))
    _, second = desk.say(AwardsCommitted(()))

    assert decided.impossible == ()
    assert [*first.asked, *second.asked] == ["robot1", "robot2"]


def test_robots_that_were_too_slow_are_asked_although_nobody_waits_for_them():
    desk = Desk("robot1", "robot2", max_asked=1)
    desk.auction("T1")
    desk.bid("robot1", T1=MAX_COST)
    desk.say(AwardsCommitted(()))
    desk.say(ROUND)
    desk.say(AwardsCommitted(()))
    desk.say(Signal.FLEET_CHANGED)
    desk.bid("robot1", T1=MAX_COST)
    assert desk.state.slow == {"robot2"}

    call, _, decided = desk.say(AwardsCommitted(()))
    desk.bid("robot2", T1=1.0)

    assert [*call.asked] == ["robot2"]
    assert [name for name, _ in decided.result.impossible] == ["T1"]
    assert desk.state.slow == frozenset()


def planner():
    """Return a desk that plans, with two robots."""
    return Desk("robot1", "robot2", plans=True)


def test_a_plan_recalls_what_changes_hands_and_waits_for_it():
    desk = planner()

    assert desk.transfer() == [SetTimer(TRANSFERS, 3.0), Recall(desk.records["T1"])]
    assert desk.state.transfers.task_ids == {"T1"}


def holding():
    """Return a desk that plans, whose robot1 has T1."""
    desk = planner()
    desk.put("T1", TaskState.ASSIGNED, "robot1")
    return desk


def test_a_plan_that_gains_next_to_nothing_is_not_followed():
    assert holding().improved(before=10.0, after=9.99, T1="robot2") == []


def test_after_two_plans_without_gain_none_is_made_until_something_changes():
    desk = holding()
    desk.improved(times=4, before=10.0, after=10.0)
    made_at_rest = desk.plans_made
    desk.say(ScheduleChanged("robot1"))
    desk.improved(before=10.0, after=10.0)

    assert (made_at_rest, desk.plans_made) == (2, 3)


def test_a_plan_that_changes_nothing_counts_as_one_without_gain():
    desk = holding()
    desk.improved(times=4, before=math.inf, after=5.0)

    assert desk.plans_made == 2


def test_a_plan_that_changes_something_is_followed_by_another():
    desk = holding()
    for _ in range(3):
        desk.improved(T1="robot2")
        desk.say(TRANSFERS)

    assert desk.plans_made == 3


def test_what_an_auction_gives_out_is_planned_again_even_if_the_last_plans_gained_nothing():
    desk = holding()
    desk.improved(times=2, before=10.0, after=10.0)
    desk.put("T1", TaskState.DONE, "robot1")
    desk.auction("T2")
    desk.bid("robot1", T2=1.0)
    effects = desk.bid("robot2", T2=2.0)
    desk.put("T2", TaskState.ASSIGNED, "robot1")
    desk.say(AwardsCommitted(result(effects).awards))
    desk.improved(before=10.0, after=10.0)

    assert desk.plans_made == 3


def test_a_robot_that_is_found_to_bid_itself_is_asked_again_once_the_others_have_answered():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")
    first = desk.state.call.auction
    found = desk.say(Signal.BIDDER_FOUND)
    desk.bid("robot1")
    effects = desk.bid("robot2", T1=1.0)

    assert found == []
    assert kinds(effects) == [SetTimer, SetTimer, Broadcast]
    assert desk.state.call.auction > first
    assert winners([*desk.bid("robot1", T1=0.5), *desk.bid("robot2", T1=1.0)]) == {"T1": "robot1"}


def test_what_nobody_could_take_is_offered_to_a_robot_that_is_found_to_bid_itself():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")
    desk.bid("robot1", T1=MAX_COST)
    desk.bid("robot2", T1=MAX_COST)
    desk.say(AwardsCommitted(()))
    desk.say(Signal.BIDDER_FOUND)

    assert kinds(desk.say(Signal.TASK_CAME)) == [SetTimer, Broadcast]


def test_a_robot_that_has_not_told_keeps_what_it_has():
    desk = planner()
    for name, robot in (("T1", "robot1"), ("T2", "robot2")):
        desk.put(name, TaskState.ASSIGNED, robot)
    desk.improve()
    desk.tell("robot1")

    *_, plan = desk.say(ROUND)

    assert [record.task.id for record in plan.records] == ["T1"]


def test_what_auctions_have_given_out_is_improved_only_by_a_leader_that_plans():
    desk = Desk("robot1", "robot2")
    desk.put("T1", TaskState.ASSIGNED, "robot1")

    assert desk.improve() == []


def test_nothing_is_improved_while_a_task_waits():
    desk = planner()
    desk.put("T1", TaskState.ASSIGNED, "robot1")
    desk.put("T2")

    assert desk.improve() == []


def test_a_task_that_changed_while_the_plan_was_made_stays_where_it_is():
    desk = planner()
    desk.put("T1", TaskState.ASSIGNED, "robot1")
    desk.improve()
    desk.tell("robot1", "robot2")
    place = Place(desk.records["T1"], "robot2", 1, Bid("robot2", "T1", 5.0))
    desk.put("T1", TaskState.STARTED, "robot1")

    assert desk.say(PlanMade(Planned((place,), before=10.0, after=5.0))) == []


def test_a_task_that_comes_drops_an_improvement_and_late_answers_are_no_error():
    desk = planner()
    desk.put("T1", TaskState.ASSIGNED, "robot1")
    desk.improve()
    dropped = desk.state.call

    effects = desk.auction("T2")

    assert kinds(effects) == [SetTimer, SetTimer, Broadcast]
    late = Bids("robot1", dropped.epoch, dropped.auction, (), dropped.round)
    assert desk.say(BidsHeard(late)) == []


def test_what_is_handed_back_for_a_transfer_goes_to_the_robot_that_was_to_get_it():
    desk = planner()
    desk.transfer()
    decided_in = (1, desk.state.call.auction, 1)
    desk.put("T1")

    decided = result(desk.say(Signal.TASK_CAME))

    assert [(bid.task_id, bid.robot_id) for bid in decided.awards] == [("T1", "robot2")]
    assert decided.reason == "exchanged: T1 from robot1 to robot2"
    assert decided.auction == decided_in


def test_what_is_not_handed_back_in_time_is_auctioned():
    desk = planner()
    desk.transfer()
    desk.say(TRANSFERS)
    desk.put("T1")

    assert kinds(desk.say(Signal.TASK_CAME)) == [SetTimer, Broadcast]


@pytest.mark.parametrize("between_rounds", [False, True])
def test_a_leader_that_steps_down_drops_everything(between_rounds):
    desk = Desk("robot1")
    desk.auction("T1")
    awards = result(desk.bid("robot1", T1=1.0)).awards if between_rounds else ()

    assert desk.say(Signal.STEPPED_DOWN) == [SetTimer(ROUND), SetTimer(TRANSFERS)]
    assert desk.state.auction is None
    assert desk.say(AwardsCommitted(awards)) == []


def test_a_leader_that_steps_down_leaves_tasks_that_were_to_change_hands_to_an_auction():
    desk = planner()
    desk.transfer()
    desk.say(Signal.STEPPED_DOWN)
    desk.put("T1")

    assert kinds(desk.say(Signal.TASK_CAME)) == [SetTimer, Broadcast]


def test_a_step_changes_nothing_but_what_it_returns():
    desk = Desk("robot1", "robot2")
    desk.auction("T1")
    desk.bid("robot1", T1=1.0)
    before, copy = desk.state, replace(desk.state)

    desk.bid("robot2", T1=2.0)

    assert before == copy
    assert before.auction.missing == {"robot2"}
