# SPDX-License-Identifier: BSD-3-Clause
"""Which tasks are offered again, and which of them change hands."""

from dataclasses import replace

from blackboard.auction.reallocation import Reallocation, exchanges
from blackboard.costing.cost import MEASURES
from blackboard.domain.bid import MAX_COST, Bid, CostTerms
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose

BOTH = frozenset({"robot1", "robot2"})


def held(name, robot, state=TaskState.ASSIGNED, tried=()):
    """Return the record of a task in a robot's schedule."""
    task = Task(name, TaskType.GA, (Pose(1.0, 1.0),))
    return TaskRecord(task, state, robot, assignment=1, tried=tried)


def offer(record, **waiting):
    """Return an offer with the waiting time that each robot would add; None: it cannot."""
    return (record,), [
        Bid(robot, record.task.id, MAX_COST)
        if seconds is None
        else Bid(robot, record.task.id, 1.0, terms=CostTerms(0, 1, 1, 0, 1, 0, seconds))
        for robot, seconds in waiting.items()
    ]


def moved(offers, threshold=0.1, measure="waiting"):
    """Return which tasks change hands, and to whom; each exchange is one text."""
    return [
        " ".join(f"{move.records[0].task.id}>{move.taker.robot_id}" for move in exchange)
        for exchange in exchanges(offers, MEASURES[measure], threshold)
    ]


def names(bundles):
    """Return the ids of what is offered; each bundle is one text."""
    return [" ".join(record.task.id for record in bundle) for bundle in bundles]


class Fleet:
    """A reallocation that steps, among records held in the order of their tasks' names."""

    def __init__(self, *records):
        shown = {record.robot: [] for record in records}
        for record in sorted(records, key=lambda each: each.task.id):
            shown[record.robot].append(record.task.id)
        self.statuses = {
            robot: RobotStatus(robot, RobotState.BUSY, Pose(0.0, 0.0), 1.0, tasks=tuple(tasks))
            for robot, tasks in shown.items()
        }
        self.records = records
        self.reallocation = Reallocation("waiting", 0.1)

    def offers(self, robots=BOTH, most=100):
        self.reallocation, bundles = self.reallocation.next_step(
            self.records, robots, self.statuses.get, most
        )
        return names(bundles)

    def resume(self):
        self.reallocation = self.reallocation.resume()

    def decide(self, *offers):
        self.reallocation, found = self.reallocation.decide(offers)
        return found


def test_a_task_moves_to_the_robot_with_which_all_tasks_wait_less():
    assert moved([offer(held("T1", "robot1"), robot1=10.0, robot2=5.0)]) == ["T1>robot2"]


def test_a_task_stays_if_it_gains_no_more_than_the_threshold():
    assert moved([offer(held("T1", "robot1"), robot1=10.0, robot2=9.0)]) == []
    assert moved([offer(held("T1", "robot1"), robot1=10.0, robot2=8.9)]) == ["T1>robot2"]


def test_two_tasks_are_swapped_together():
    offers = [
        offer(held("T1", "robot1"), robot1=10.0, robot2=2.0),
        offer(held("T2", "robot2"), robot1=3.0, robot2=9.0),
    ]

    assert moved(offers) == ["T1>robot2 T2>robot1"]


def test_a_chain_of_moves_begins_with_the_robot_that_takes_nothing():
    offers = [
        offer(held("T1", "robot1"), robot1=10.0, robot2=11.0, robot3=1.0),
        offer(held("T2", "robot2"), robot1=1.0, robot2=10.0, robot3=11.0),
    ]

    assert moved(offers) == ["T2>robot1 T1>robot3"]


def test_each_exchange_has_to_gain_enough_by_itself():
    small = [
        offer(held("T1", "robot1"), robot1=100.0, robot2=95.0),
        offer(held("T2", "robot2"), robot1=95.0, robot2=100.0),
    ]
    large = [
        offer(held("T3", "robot3"), robot3=20.0, robot4=1.0),
        offer(held("T4", "robot4"), robot3=1.0, robot4=20.0),
    ]

    assert moved(small + large) == ["T3>robot4 T4>robot3"]


def test_no_robot_gets_two_bundles():
    offers = [
        offer(held("T1", "robot1"), robot1=10.0, robot2=1.0, robot3=9.0),
        offer(held("T3", "robot3"), robot1=20.0, robot2=2.0, robot3=8.0),
    ]

    # One of them to robot2: T1 there gains 9, T3 there gains 6.
    assert moved(offers) == ["T1>robot2"]


def test_only_the_fleet_s_measure_counts():
    far = Bid("robot1", "T1", 1.0, terms=CostTerms(0, 1, 1, way=9.0, eta=1, finish=50, waiting=1))
    near = Bid("robot2", "T1", 9.0, terms=CostTerms(0, 1, 1, way=1.0, eta=9, finish=90, waiting=9))
    here, there = ((held("T1", "robot1"),), [far, near]), ((held("T1", "robot2"),), [far, near])

    assert moved([here], measure="way") == ["T1>robot2"]
    assert moved([there], measure="way") == []
    assert moved([here], measure="waiting") == moved([here], measure="makespan") == []
    assert moved([there], measure="waiting") == ["T1>robot1"]
    assert moved([there], measure="makespan") == ["T1>robot1"]


def test_the_makespan_counts_the_schedule_that_ends_last():
    def ends(task, robot, **finish):
        bids = [
            Bid(name, task, 1.0, terms=CostTerms(0, 1, 1, 0, 1, finish=end, waiting=0))
            for name, end in finish.items()
        ]
        return (held(task, robot),), bids

    # The schedules end earlier in sum, but the last one ends later.
    offers = [
        ends("T1", "robot1", robot1=100.0, robot2=40.0),
        ends("T2", "robot2", robot1=104.0, robot2=50.0),
    ]

    assert moved(offers, measure="makespan") == []


def test_a_task_that_its_own_robot_does_not_bid_on_stays():
    assert moved([offer(held("T1", "robot1"), robot1=None, robot2=1.0)]) == []
    assert moved([offer(held("T1", "robot1"), robot2=1.0)]) == []


def test_a_robot_that_cannot_or_has_tried_in_vain_gets_nothing():
    assert moved([offer(held("T1", "robot1"), robot1=900.0, robot2=None)]) == []
    record = held("T1", "robot1", tried=("robot2",))
    assert moved([offer(record, robot1=10.0, robot2=1.0)]) == []


def test_a_robot_whose_bid_has_no_cost_terms_gets_nothing():
    bundle, bids = offer(held("T1", "robot1"), robot1=10.0)

    assert moved([(bundle, [*bids, Bid("robot2", "T1", 0.1)])]) == []


def test_nothing_moves_if_nothing_is_offered():
    assert moved([]) == []


def steps(fleet, count):
    """Return what is offered in so many steps, as if each gained."""
    offered = []
    for _ in range(count):
        offered.append(fleet.offers())
        fleet.resume()
    return offered


def test_each_robot_offers_one_bundle_and_in_every_third_pass_only_takes():
    fleet = Fleet(held("T1", "robot1"), held("T2", "robot1"), held("T3", "robot2"))

    assert steps(fleet, 6) == [
        ["T3"],  # the first pass begins with its second step
        ["T1 T2", "T3"],
        ["T2", "T3"],
        ["T1"],
        ["T2"],
        ["T3"],
    ]


def test_ends_of_schedules_are_offered_in_the_robot_s_order():
    records = [held(name, "robot1") for name in ("T3", "T1", "T2")]
    fleet = Fleet(*records, held("T4", "robot2"))

    offered = {name for step in steps(fleet, 18) for name in step}

    assert offered == {"T1", "T2", "T3", "T1 T2 T3", "T2 T3", "T4"}


def test_a_bundle_has_one_priority():
    urgent = held("T1", "robot1")
    urgent = replace(urgent, task=replace(urgent.task, priority=5))
    fleet = Fleet(urgent, held("T2", "robot1"), held("T3", "robot1"), held("T4", "robot2"))

    offered = {name for step in steps(fleet, 18) for name in step}

    assert "T2 T3" in offered
    assert not any(name.startswith("T1 ") for name in offered)


def test_it_rests_after_some_passes_without_a_gain():
    fleet = Fleet(held("T1", "robot1"), held("T2", "robot1"), held("T3", "robot2"))

    offered = [fleet.offers() for _ in range(8)]

    assert [] not in offered[:6]
    assert offered[6:] == [[], []]


def test_other_robots_of_a_large_fleet_offer_in_each_step_until_all_have():
    robots = [f"robot{number}" for number in range(6)]
    fleet = Fleet(*(held(f"T{number}", robot) for number, robot in enumerate(robots)))

    offered = [fleet.offers(frozenset(robots), 2) for _ in range(10)]

    assert {name for step in offered for name in step} == {f"T{number}" for number in range(6)}
    assert all(len(step) <= 2 for step in offered)
    assert offered[9] == []


def test_it_begins_again_after_a_change():
    fleet = Fleet(held("T1", "robot1"))
    for _ in range(3):
        fleet.offers()
    rests = fleet.offers() == []
    fleet.resume()

    assert rests
    assert fleet.offers() == ["T1"]


def test_neither_begun_tasks_nor_those_of_robots_out_of_service_are_offered():
    fleet = Fleet(
        held("T1", "robot1", TaskState.STARTED), held("T2", "robot3"), held("T3", "robot2")
    )

    assert fleet.offers() == ["T3"]


def test_a_lone_robot_offers_nothing():
    fleet = Fleet(held("T1", "robot1"))

    assert fleet.offers(frozenset({"robot1"})) == []


def test_in_each_pass_a_task_meets_another_of_the_next_robot():
    fleet = Fleet(
        held("T1", "robot1"), held("T2", "robot1"), held("T3", "robot2"), held("T4", "robot2")
    )

    met = {tuple(step) for step in steps(fleet, 40)}

    assert {("T1", "T3"), ("T1", "T4"), ("T2", "T3"), ("T2", "T4")} <= met


def test_it_goes_on_after_a_gain():
    fleet = Fleet(record := held("T1", "robot1"))
    fleet.offers()

    assert fleet.decide(offer(record, robot1=10.0, robot2=5.0))

    assert fleet.offers() == ["T1"]
