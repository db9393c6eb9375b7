# SPDX-License-Identifier: BSD-3-Clause
"""The blackboard, with the test in the robots' and the operator's place."""

import math
from dataclasses import replace

import numpy as np
import pytest

from blackboard.blackboard import Blackboard
from blackboard.characteristics import RobotState, RobotStatus
from blackboard.cost import MAX_COST, Bid, Bids
from blackboard.pose import Pose
from blackboard.record import TaskUpdate
from blackboard.settings import BlackboardSettings
from blackboard.talker import (
    NEW_TASK,
    ROBOT_STATUS,
    SYNC,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_CANCEL,
    TASK_COST,
    TASK_STATE,
)
from blackboard.task import Task, TaskState, TaskType
from blackboard.testing import Network, NetworkTalker, lone_backup
from blackboard.ways import Grid, GridWays

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
GO = Task("T1", TaskType.GA, (A,), priority=3)
CARRY = Task("T2", TaskType.GPAB, (A, B), payload=2.0)
ROUND = Task("T3", TaskType.GAB, (A, B))
WAITING, ASSIGNED, STARTED, DONE, REJECTED, CANCELLED, FAILED = TaskState
SOON = 0.01  # more than any message needs [s]


class Rig:
    """A blackboard on a floor of 4 m x 4 m with a wall, and what it says."""

    def __init__(self, **settings):
        self.network = Network()
        self.talker = NetworkTalker(self.network, "blackboard")
        blocked = np.zeros((40, 40), dtype=bool)
        blocked[:, 20] = True
        backup = lone_backup(self.talker)
        ways = GridWays(Grid(blocked, 0.1))
        Blackboard(self.talker, backup, ways, BlackboardSettings(**settings)).start()
        backup.start()

    def wait(self, duration=SOON):
        self.network.run(duration)

    def join(self, *robots):
        for robot in robots:
            self.status(robot)

    def status(self, robot, state=RobotState.IDLE, tasks=()):
        status = RobotStatus(robot, state, Pose(0.0, 0.0), charge=0.8, tasks=tuple(tasks))
        self.network.send(ROBOT_STATUS, status)
        self.wait()

    def post(self, *tasks):
        for task in tasks:
            self.network.send(NEW_TASK, task)
        self.wait()

    def cancel(self, task_id):
        self.network.send(TASK_CANCEL, task_id)
        self.wait()

    def bid(self, robot, auction=None, **costs):
        """Answer the last broadcast, or another one."""
        asked = self.said(TASK_BROADCAST)[-1]
        number = auction or asked.auction
        bids = tuple(
            Bid(robot, name, cost, eta=10.0, reason="cannot" if cost == MAX_COST else "")
            for name, cost in costs.items()
        )
        self.network.send(TASK_COST, Bids(robot, 1, number, bids, asked.round))
        self.wait()

    def report(self, robot, task, state, assignment=1, **fields):
        update = TaskUpdate(task.id, state, robot, assignment=assignment)
        self.network.send(TASK_STATE, replace(update, **fields))
        self.wait()

    def assign(self, task, robot="robot1"):
        """Have a task given to a robot."""
        self.join(robot)
        self.post(task)
        self.bid(robot, **{task.id: 1.0})

    def said(self, topic):
        return [message for name, message in self.network.heard if name == topic]

    def states(self, task):
        """Return (state, robot) of all that was said about a task."""
        said = self.said(TASK_STATE)
        return [(update.state, update.robot_id) for update in said if update.task_id == task.id]

    def orders(self, *, take_back=False):
        """Return (task, robot) of the orders."""
        said = self.said(TASK_ASSIGN)
        return [(each.task.id, each.robot_id) for each in said if each.take_back == take_back]

    def record(self, task):
        """Return a task as the task list has it."""
        self.wait(0.3)
        records = self.said(SYNC)[-1].records
        return next((record for record in records if record.task.id == task.id), None)

    @property
    def offered(self):
        """What was broadcast last."""
        return [task.id for task, _ in self.said(TASK_BROADCAST)[-1].tasks]


# Taking in.


def test_a_good_task_is_taken_in_and_said_to_wait():
    rig = Rig()
    rig.post(GO)

    update = rig.said(TASK_STATE)[0]
    assert (update.task_id, update.state, update.robot_id) == ("T1", WAITING, "")
    assert (update.step, update.steps, update.epoch) == (0, 1, 1)


def test_a_bad_task_is_rejected_with_the_reason_and_never_enters_the_list():
    rig = Rig()
    rig.post(replace(GO, goals=(Pose(2.05, 1.0),)))

    (update,) = rig.said(TASK_STATE)
    assert update.state is REJECTED
    assert "goal A (2.05, 1.00) is inside a wall" in update.reason
    assert rig.record(GO) is None


def test_only_the_beginning_of_a_name_that_is_too_long_is_repeated():
    rig = Rig()
    rig.post(replace(GO, id="x" * 100_000))

    (update,) = rig.said(TASK_STATE)
    assert update.state is REJECTED
    assert len(update.task_id) == 64


def test_goals_that_will_not_be_visited_are_said():
    rig = Rig()
    rig.post(replace(GO, goals=(A, B)))

    assert "not used" in rig.said(TASK_STATE)[0].reason


def test_the_same_task_again_repeats_where_it_stands():
    rig = Rig()
    rig.assign(GO)
    rig.post(replace(GO, posted=99.0))

    assert rig.states(GO)[-1] == (ASSIGNED, "robot1")
    assert rig.orders() == [("T1", "robot1")]


def test_a_done_task_posted_again_is_still_done_and_not_done_again():
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, DONE)
    rig.post(GO)

    assert rig.states(GO)[-1] == (DONE, "robot1")
    assert len(rig.said(TASK_BROADCAST)) == 1


def test_another_task_by_a_taken_name_is_refused_and_the_first_goes_on():
    rig = Rig()
    rig.assign(GO)
    rig.post(replace(GO, priority=4))

    update = rig.said(TASK_STATE)[-1]
    assert update.state is REJECTED
    assert update.reason == "the id is taken by another task; post it with another id"
    assert rig.record(GO).state is ASSIGNED
    assert rig.record(GO).task.priority == 3


# The auction.


def test_all_that_waits_is_broadcast_with_the_step_to_begin_at():
    rig = Rig()
    rig.join("robot1")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=5.0)

    assert rig.offered == ["T2", "T3"]
    assert [step for _, step in rig.said(TASK_BROADCAST)[-1].tasks] == [0, 0]


def test_the_auction_ends_as_soon_as_everyone_in_service_has_answered():
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.status("robot3", RobotState.DEFECT)
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    before = rig.orders()
    rig.bid("robot2", T1=4.0)

    assert before == []
    assert rig.orders() == [("T1", "robot2")]
    assert rig.network.now < 0.2


def test_the_auction_ends_at_the_bid_timeout_at_the_latest():
    rig = Rig(bid_timeout=2.0)
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    rig.wait(1.9)
    before = rig.orders()
    rig.wait(0.2)

    assert before == []
    assert rig.orders() == [("T1", "robot1")]


def test_an_assignment_is_said_with_robot_number_and_promise():
    rig = Rig()
    rig.assign(GO)

    update, order = rig.said(TASK_STATE)[-1], rig.said(TASK_ASSIGN)[-1]
    assert (update.state, update.robot_id, update.assignment) == (ASSIGNED, "robot1", 1)
    assert update.eta == 10.0
    assert (order.task, order.robot_id, order.assignment) == (GO, "robot1", 1)


def test_a_robot_that_was_too_slow_is_not_waited_for_again():
    rig = Rig(bid_timeout=2.0)
    rig.join("robot1", "slow")
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    rig.wait(2.1)
    rig.post(CARRY)
    rig.bid("robot1", T2=5.0)

    assert rig.orders() == [("T1", "robot1"), ("T2", "robot1")]


def test_a_robot_that_was_slow_once_is_waited_for_again_when_it_has_answered():
    rig = Rig(bid_timeout=2.0)
    rig.join("robot1", "slow")
    rig.post(GO)
    rig.bid("robot1", T1=5.0)
    rig.wait(2.1)
    rig.bid("slow", T1=1.0)
    rig.post(CARRY)
    rig.bid("robot1", T2=5.0)
    rig.bid("slow", T2=1.0)

    assert rig.orders() == [("T1", "robot1"), ("T2", "slow")]


def test_if_all_are_slow_they_are_waited_for():
    rig = Rig(bid_timeout=2.0)
    rig.join("slow", "slower")
    rig.post(GO)
    rig.wait(2.1)
    rig.post(CARRY)
    rig.bid("slow", T2=3.0)
    rig.bid("slower", T2=1.0)

    assert rig.orders() == [("T2", "slower")]


def test_several_tasks_are_spread_over_the_robots_one_in_each_round():
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=1.0)
    rig.bid("robot2", T1=2.0)
    rig.bid("robot1", T2=1.0, T3=2.0)
    rig.bid("robot2", T2=2.0, T3=1.0)

    assert rig.orders() == [("T1", "robot1"), ("T2", "robot1"), ("T3", "robot2")]


def test_only_the_winner_is_asked_again_and_told_what_it_has_won():
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=1.0)
    rig.bid("robot2", T1=2.0)
    rig.bid("robot1", T2=1.0, T3=1.0)
    rig.bid("robot2", T2=2.0, T3=2.0)

    asked = rig.said(TASK_BROADCAST)[-1]
    assert asked.asked == {"robot1": "T2"}
    assert rig.offered == ["T3"]
    assert (asked.auction, asked.round) == (rig.said(TASK_BROADCAST)[-2].auction, 3)


def test_a_robot_that_has_finished_a_task_meanwhile_is_asked_again():
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.post(CARRY, ROUND)
    rig.bid("robot1", T1=2.0)
    rig.bid("robot2", T1=1.0)
    rig.bid("robot2", T2=2.0, T3=9.0)
    rig.report("robot2", GO, DONE, steps=1, step=1)
    rig.bid("robot1", T2=1.0, T3=1.0)

    assert rig.said(TASK_BROADCAST)[-1].asked == {"robot1": "T2", "robot2": ""}


def test_a_robot_that_is_out_of_service_gives_no_bid_that_counts():
    rig = Rig()
    rig.join("robot1")
    rig.status("robot2", RobotState.DEFECT)
    rig.post(GO)
    rig.bid("robot2", T1=1.0)
    rig.bid("robot1", T1=5.0)

    assert rig.orders() == [("T1", "robot1")]
    assert "is not in service" in rig.talker.warnings[0]


def test_a_robot_that_breaks_down_after_its_bid_is_given_nothing():
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot2", T1=1.0)
    rig.status("robot2", RobotState.DEFECT)
    rig.bid("robot1", T1=5.0)

    assert rig.orders() == [("T1", "robot1")]


def test_the_most_urgent_task_is_given_first():
    rig = Rig()
    rig.post(GO, replace(CARRY, priority=9))
    rig.join("robot1")
    rig.bid("robot1", T1=1.0, T2=500.0)

    assert rig.orders() == [("T2", "robot1")]


def test_without_a_robot_a_task_waits_and_says_so():
    rig = Rig()
    rig.post(GO)

    assert rig.record(GO).reason == "no robot is in service"
    assert not rig.said(TASK_BROADCAST)


def test_a_task_nobody_can_take_waits_with_every_robot_s_reason():
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot1", T1=MAX_COST)
    rig.bid("robot2", T1=MAX_COST)

    assert rig.states(GO) == [(WAITING, ""), (WAITING, "")]
    assert rig.record(GO).reason == "nobody can take it now: robot1: cannot; robot2: cannot"


def nobody_can():
    """Return a rig on which robot1 cannot take a task now."""
    rig = Rig(retry_period=30.0)
    rig.status("robot1", tasks=["T0"])
    rig.post(GO)
    rig.bid("robot1", T1=MAX_COST)
    return rig


def busy_seconds(rig, seconds):
    """Let time pass while robot1 says every second that it is still at work."""
    for _ in range(seconds):
        rig.wait(1.0)
        rig.status("robot1", tasks=["T0"])


def test_it_is_not_auctioned_again_while_nothing_changes():
    rig = nobody_can()
    busy_seconds(rig, 29)

    assert len(rig.said(TASK_BROADCAST)) == 1


@pytest.mark.parametrize(
    "change",
    [
        lambda rig: rig.join("robot2"),
        lambda rig: rig.status("robot1"),
        lambda rig: busy_seconds(rig, 30),
        lambda rig: [rig.status("robot1", RobotState.DEFECT), rig.status("robot1")],
    ],
    ids=["a robot joins", "a list is shorter", "time passes", "a robot is back in service"],
)
def test_it_is_auctioned_again_when_something_changes(change):
    rig = nobody_can()

    change(rig)

    assert len(rig.said(TASK_BROADCAST)) == 2
    assert rig.offered == ["T1"]


def test_a_change_while_the_auction_is_open_is_not_lost():
    rig = Rig()
    rig.join("robot1")
    rig.post(GO)
    rig.join("robot2")
    rig.bid("robot1", T1=MAX_COST)

    assert len(rig.said(TASK_BROADCAST)) == 2


def test_after_a_change_while_the_auction_is_open_all_bid_again_and_then_it_rests():
    rig = Rig()
    rig.status("robot1", tasks=["T0"])
    rig.join("robot2")
    rig.post(GO)
    rig.bid("robot1", T1=MAX_COST)
    rig.status("robot1")
    rig.bid("robot2", T1=MAX_COST)
    asked = rig.said(TASK_BROADCAST)
    rig.bid("robot1", T1=MAX_COST)
    rig.bid("robot2", T1=MAX_COST)
    rig.wait(1.0)

    assert [each.asked for each in asked] == [None, None]
    assert len(rig.said(TASK_BROADCAST)) == 2


def test_another_task_is_auctioned_without_the_one_nobody_can_take():
    rig = nobody_can()
    rig.post(CARRY)

    assert rig.offered == ["T2"]


@pytest.mark.parametrize(
    "answer",
    [
        {"T1": math.nan},
        {"T1": -1.0},
        {"T1": 1000.5},
        {"T1": math.inf},
        {"T9": 1.0},
        {"T1": 1.0, "T9": 1.0},
        {"auction": 99, "T1": 1.0},
    ],
    ids=str,
)
def test_a_bad_answer_is_refused_and_gives_nobody_anything(answer):
    rig = Rig()
    rig.join("robot1", "robot2")
    rig.post(GO)
    rig.bid("robot2", **answer)
    rig.bid("robot1", T1=999.0)
    rig.wait(2.1)

    assert rig.orders() == [("T1", "robot1")]
    assert len(rig.talker.warnings) == 1
    assert rig.talker.warnings[0].startswith("a message on task_cost is refused: ")


def test_an_answer_after_the_auction_changes_nothing():
    rig = Rig()
    rig.assign(GO)
    rig.join("robot2")
    rig.bid("robot2", T1=0.5)

    assert rig.orders() == [("T1", "robot1")]
    assert not rig.talker.warnings


# Orders.


def test_an_order_that_the_robot_did_not_hear_is_given_again():
    rig = Rig(order_timeout=2.0)
    rig.assign(GO)
    rig.wait(1.0)
    rig.status("robot1")
    rig.wait(1.1)
    rig.status("robot1")

    assert rig.orders() == [("T1", "robot1"), ("T1", "robot1")]


def test_an_order_that_the_robot_has_on_its_list_is_not_given_again():
    rig = Rig(order_timeout=2.0)
    rig.assign(GO)
    for _ in range(5):
        rig.wait(1.0)
        rig.status("robot1", tasks=["T1"])

    assert rig.orders() == [("T1", "robot1")]


def test_what_is_done_is_not_ordered_again():
    rig = Rig(order_timeout=2.0)
    rig.assign(GO)
    rig.report("robot1", GO, DONE)
    rig.wait(3.0)
    rig.status("robot1")

    assert rig.orders() == [("T1", "robot1")]


# What robots report.


def test_what_its_robot_reports_is_written_down_and_not_said_again():
    rig = Rig()
    rig.assign(CARRY)
    rig.report("robot1", CARRY, STARTED, step=1, eta=33.0)
    record = rig.record(CARRY)

    assert (record.state, record.robot, record.step, record.eta) == (STARTED, "robot1", 1, 33.0)
    assert rig.states(CARRY) == [(WAITING, ""), (ASSIGNED, "robot1"), (STARTED, "robot1")]


def test_a_report_that_comes_late_does_not_undo_a_step():
    rig = Rig()
    rig.assign(CARRY)
    rig.report("robot1", CARRY, STARTED, step=2)
    rig.report("robot1", CARRY, STARTED, step=1)

    assert rig.record(CARRY).step == 2


def test_done_is_done():
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, DONE, step=1)

    assert rig.record(GO).state is DONE


@pytest.mark.parametrize("state", [WAITING, STARTED, FAILED])
def test_what_another_robot_reports_changes_nothing(state):
    rig = Rig()
    rig.assign(GO)
    rig.report("robot2", GO, state)

    assert rig.record(GO).state is ASSIGNED


@pytest.mark.parametrize("state", [WAITING, STARTED, FAILED])
def test_what_is_reported_on_an_earlier_assignment_changes_nothing(state):
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, WAITING)
    rig.bid("robot1", T1=1.0)
    rig.report("robot1", GO, state, assignment=1)

    assert (rig.record(GO).state, rig.record(GO).assignment) == (ASSIGNED, 2)


@pytest.mark.parametrize("state", [REJECTED, CANCELLED, ASSIGNED])
def test_what_is_not_a_robot_s_to_say_changes_nothing(state):
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, STARTED)
    rig.report("robot1", GO, state)

    assert rig.record(GO).state is STARTED


def test_a_report_on_a_task_nobody_knows_is_no_task():
    rig = Rig()
    rig.report("robot1", GO, DONE)

    assert rig.record(GO) is None


def test_done_is_believed_from_a_robot_that_has_lost_the_task_and_the_other_is_stopped():
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, WAITING)
    rig.join("robot2")
    rig.bid("robot1", T1=MAX_COST)
    rig.bid("robot2", T1=1.0)
    rig.bid("robot1", T1=MAX_COST)
    rig.bid("robot2", T1=1.0)

    rig.report("robot1", GO, DONE, assignment=1)

    assert (rig.record(GO).state, rig.record(GO).robot) == (DONE, "robot1")
    assert rig.orders(take_back=True) == [("T1", "robot2")]


def test_a_task_that_is_handed_back_is_auctioned_again_at_once():
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, WAITING, reason="robot1: aborted: no way")

    record = rig.record(GO)
    assert (record.state, record.robot, record.tried) == (WAITING, "", ("robot1",))
    assert record.reason == "robot1: aborted: no way"
    assert len(rig.said(TASK_BROADCAST)) == 2


def test_the_next_robot_goes_on_where_a_round_was_left_and_begins_a_pick_anew():
    rig = Rig()
    for task in (ROUND, CARRY):
        rig.assign(task)
        rig.report("robot1", task, WAITING, step=1)
        rig.bid("robot1", **{task.id: 1.0})

    steps = {order.task.id: order.step for order in rig.said(TASK_ASSIGN) if order.assignment == 2}
    assert steps == {"T3": 1, "T2": 0}


def test_a_step_that_a_task_does_not_have_is_taken_for_its_last():
    rig = Rig()
    rig.assign(ROUND)
    rig.report("robot1", ROUND, WAITING, step=200)
    rig.bid("robot1", T3=1.0)

    assert rig.said(TASK_ASSIGN)[-1].step == 2


def test_a_task_that_robots_keep_handing_back_is_given_up():
    rig = Rig(most_hand_backs=3)
    rig.assign(GO)
    for assignment in (1, 2, 3):
        rig.report("robot1", GO, WAITING, assignment, reason="robot1: aborted: stuck")
        if assignment < 3:
            rig.bid("robot1", T1=1.0)

    record = rig.record(GO)
    assert record.state is FAILED
    assert record.reason == "given up after 3 tries, the last: robot1: aborted: stuck"
    assert rig.states(GO)[-1] == (FAILED, "robot1")


def test_a_task_whose_load_is_on_board_stays_failed():
    rig = Rig()
    rig.assign(CARRY)
    rig.report("robot1", CARRY, FAILED, step=2, reason="its load is on board")

    assert rig.record(CARRY).state is FAILED
    assert rig.record(CARRY).reason == "its load is on board"
    assert len(rig.said(TASK_BROADCAST)) == 1


def test_a_report_that_is_repeated_is_answered_with_the_list_again():
    rig = Rig()
    rig.assign(GO)
    rig.report("robot1", GO, DONE)
    rig.wait(1.0)
    before = len(rig.said(SYNC))
    rig.report("robot1", GO, DONE)
    rig.wait(1.0)

    assert len(rig.said(SYNC)) == before + 1
    assert rig.said(SYNC)[-1].version == rig.said(SYNC)[-2].version


# Cancelling.


def in_state(state):
    """Return a rig with a task in a state."""
    rig = Rig()
    if state is WAITING:
        rig.post(ROUND)
        return rig
    rig.assign(ROUND)
    if state in {STARTED, DONE, FAILED}:
        rig.report("robot1", ROUND, state)
    elif state is CANCELLED:
        rig.cancel("T3")
    return rig


@pytest.mark.parametrize("state", [WAITING, ASSIGNED, STARTED])
def test_an_open_task_can_be_cancelled_and_its_robot_is_told(state):
    rig = in_state(state)
    rig.cancel("T3")

    record = rig.record(ROUND)
    assert (record.state, record.reason) == (CANCELLED, "cancelled by an operator")
    assert rig.states(ROUND)[-1][0] is CANCELLED
    assert rig.orders(take_back=True) == ([] if state is WAITING else [("T3", "robot1")])


@pytest.mark.parametrize("state", [DONE, CANCELLED, FAILED])
def test_a_task_that_has_ended_stays_as_it_is_and_that_is_said(state):
    rig = in_state(state)
    said = len(rig.states(ROUND))
    rig.cancel("T3")

    assert rig.record(ROUND).state is state
    assert rig.states(ROUND)[said:] == [(state, "robot1")]


def test_a_cancelled_task_is_not_given_to_who_bids_on_it():
    rig = Rig()
    rig.post(GO, CARRY)
    rig.join("robot1")
    rig.cancel("T1")
    rig.bid("robot1", T1=1.0, T2=2.0)

    assert rig.orders() == [("T2", "robot1")]


def test_done_after_a_cancel_does_not_count():
    rig = in_state(CANCELLED)
    rig.report("robot1", ROUND, DONE)

    assert rig.record(ROUND).state is CANCELLED


def test_what_does_not_exist_cannot_be_cancelled():
    rig = Rig()
    rig.cancel("never there")

    (warning,) = rig.talker.warnings
    assert warning.startswith(
        "a message on task_cancel is refused: there is no task 'never there'"
    )
    assert warning.endswith("on the list; it may have ended long ago")
    assert not rig.said(TASK_STATE)


# Robots that fall silent.


def test_a_robot_that_falls_silent_is_said_to_be_offline_and_its_tasks_wait_for_another():
    rig = Rig(reassign=5.0)
    rig.assign(GO)
    rig.wait(6.1)

    status = rig.said(ROBOT_STATUS)[-1]
    assert (status.robot_id, status.state) == ("robot1", RobotState.OFFLINE)
    assert (rig.record(GO).state, rig.record(GO).robot) == (WAITING, "")


def test_a_robot_that_is_back_without_its_task_is_given_it_again():
    rig = Rig(reassign=5.0, order_timeout=2.0)
    rig.assign(GO)
    rig.wait(4.0)
    rig.status("robot1")

    assert rig.orders() == [("T1", "robot1"), ("T1", "robot1")]


def test_a_robot_that_is_offline_is_not_waited_for():
    rig = Rig(reassign=5.0)
    rig.join("robot1", "gone")
    for _ in range(7):
        rig.wait(1.0)
        rig.status("robot1")
    rig.post(GO)
    rig.bid("robot1", T1=1.0)

    assert rig.orders() == [("T1", "robot1")]


# What has ended is forgotten in the end.


def forgotten(**settings):
    """Return a rig that has forgotten a task which robot1 has done."""
    rig = Rig(keep_ended=30.0, **settings)
    rig.assign(GO)
    rig.report("robot1", GO, DONE)
    for _ in range(35):
        rig.wait(1.0)
        rig.join("robot1")
    assert rig.record(GO) is None
    return rig


def test_a_task_that_has_ended_leaves_the_list_after_its_time():
    rig = Rig(keep_ended=30.0)
    rig.post(GO)
    rig.cancel("T1")

    rig.wait(29.0)
    assert rig.record(GO).state is CANCELLED
    rig.wait(3.0)
    assert rig.record(GO) is None


def test_a_robot_that_reports_on_a_forgotten_task_is_told_to_report_no_more():
    rig = forgotten()
    rig.report("robot1", GO, DONE)

    order = rig.said(TASK_ASSIGN)[-1]
    assert (order.robot_id, order.forgotten, order.take_back) == ("robot1", True, True)
    assert (order.task.id, order.assignment) == ("T1", 1)
    assert rig.record(GO) is None


def test_a_robot_that_has_a_forgotten_task_on_its_list_is_told_to_drop_it():
    rig = forgotten()
    rig.status("robot1", tasks=["T1"])

    assert rig.said(TASK_ASSIGN)[-1].forgotten


def test_an_id_that_is_forgotten_may_be_used_again_for_another_task():
    rig = forgotten()
    rig.post(replace(GO, goals=(B,)))
    rig.bid("robot1", T1=1.0)

    assert rig.record(GO).task.goals == (B,)
    assert rig.said(TASK_ASSIGN)[-1].assignment == 2


def test_a_late_report_on_a_forgotten_task_says_nothing_of_another_one_of_its_id():
    rig = forgotten()
    rig.post(GO)
    rig.bid("robot1", T1=1.0)
    rig.report("robot1", GO, DONE, assignment=1)

    assert rig.record(GO).state is ASSIGNED
    assert rig.said(TASK_ASSIGN)[-1].forgotten

    rig.report("robot1", GO, DONE, assignment=2)
    assert rig.record(GO).state is DONE


def test_a_forgotten_task_cannot_be_cancelled_and_the_reason_is_said():
    rig = forgotten()
    rig.cancel("T1")

    assert rig.states(GO)[-1] == (DONE, "robot1")
    assert (
        "there is no task 'T1' on the list; it may have ended long ago" in rig.talker.warnings[-1]
    )
