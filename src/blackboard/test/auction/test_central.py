# SPDX-License-Identifier: BSD-3-Clause
"""Bids that the blackboard works out are those that the robots would make."""

import math
import random
from dataclasses import replace

import pytest

from blackboard.auction.central import Central
from blackboard.costing.bid_basis import BidBasis, Bids
from blackboard.costing.cost import COST_MODELS
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.experience import Experience
from blackboard.costing.insertion import Aging
from blackboard.costing.schedule import Entry, Schedule
from blackboard.domain.battery import Battery
from blackboard.domain.bid import Bid, Exclusion
from blackboard.domain.record import Broadcast, Order, TaskRecord
from blackboard.domain.settings import RobotSettings
from blackboard.domain.task import Task, TaskType, split_task
from blackboard.errors import BidRefusedError
from blackboard.robot.charging import Charging, ChargingPlan
from blackboard.robot.respondent import Respondent
from blackboard.robot.service import Service
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT
from hive_lab.virtual.network import Network, NetworkTalker

NOW = 500.0
CHARGERS = ChargingPlan({"charger 1": Pose(3000.0, 4000.0)})
BASIS = BidBasis(SMALL_ROBOT, "report", 120.0, Pose(0.0, 0.0), 1.0)
OFFER = Broadcast(3, 7, ((Task("T1", TaskType.GA, (Pose(5.0, 0.0),)), 0),), round=2)


ONE = frozenset({"robot1"})


class Fleet:
    """A random robot with a schedule, and tasks that are offered to it."""

    def __init__(self, seed):
        self.draw = random.Random(seed)
        self.network = Network()
        self.network.now = NOW
        self.tasks = [self.task(f"T{number}") for number in range(self.draw.randint(1, 8))]
        self.listed = [self.task(f"L{number}") for number in range(self.draw.randint(0, 6))]
        self.at_work = bool(self.listed) and self.draw.random() < 0.7
        self.pose = self.place()
        self.respondent = self.make_respondent()
        offered = self.tasks + self.draw.sample(self.listed, len(self.listed) // 2)
        self.broadcast = Broadcast(
            1, 2, tuple((task, self.step(task)) for task in offered), round=3
        )

    def place(self):
        """Return a random place."""
        return Pose(self.draw.uniform(0.0, 90.0), self.draw.uniform(0.0, 50.0))

    def task(self, name):
        """Return a random task, some too heavy, some old."""
        kind = self.draw.choice(list(TaskType))
        goals = tuple(self.place() for _ in range(self.draw.randint(2, 4)))
        payload = self.draw.choice([0.0, 3.0, 10.0, 30.0])
        posted = self.draw.choice([0.0, NOW - 300.0, NOW - 1.0])
        return Task(name, kind, goals, self.draw.choice([0, 0, 5, 10]), payload, posted=posted)

    def step(self, task):
        """Return how far a task may have come."""
        return self.draw.randrange(len(split_task(task)))

    def make_respondent(self):
        """Return what answers for the robot."""
        settings = RobotSettings(self.draw.choice(list(COST_MODELS)), self.draw.uniform(10, 300))
        battery = Battery(SMALL_ROBOT.battery, self.draw.choice([1.0, 0.6, 0.16, 0.11]))
        body = replace(SMALL_ROBOT, capabilities=frozenset(self.draw.sample(list(TaskType), 3)))
        talker, path_lengths, service = (
            NetworkTalker(self.network, "robot1"),
            EuclideanLengths(),
            Service(),
        )
        if self.draw.random() < 0.1:
            service.set("defect")
        plan = self.draw.choice([CHARGERS, ChargingPlan()])
        all_learned = (2.0, 1.4, 0.6, 1.1, 0.8, 1.2, 0.9, 0.5, 0.05, 7.0)
        known = Experience(body, self.draw.choice([(), (2.0, 1.4, 0.6), all_learned]))
        charging = Charging(
            talker, "robot1", body, battery, path_lengths, None, service, plan, known
        )
        aging = Aging(lambda: NOW, settings.aging)
        schedule = Schedule(body, path_lengths, settings.cost_model, aging, known)
        entries = [Entry(Order(task, "robot1"), self.step(task)) for task in self.listed]
        schedule.restore(entries)
        return Respondent("robot1", body, battery, schedule, charging, settings)


def central(*tasks):
    """Return the central office of a blackboard that knows some tasks."""
    records = {task.id: TaskRecord(task) for task in tasks}
    return Central(records.get, lambda _radius: EuclideanLengths(), lambda: NOW, 2000)


@pytest.mark.parametrize("seed", range(200))
def test_the_blackboard_works_out_exactly_the_bids_that_the_robot_would_make(seed):
    fleet = Fleet(seed)
    made = fleet.respondent.answer(fleet.broadcast, fleet.pose, at_work=fleet.at_work)
    office = central(*fleet.tasks, *fleet.listed)
    (question,) = office.questions(fleet.broadcast, ONE, ONE)
    told = fleet.respondent.answer(question, fleet.pose, at_work=fleet.at_work)

    assert question.tasks == ()
    assert told.bids == ()
    assert office.bids(told, fleet.broadcast) == made


def test_the_fleets_of_that_test_hold_bids_and_refusals_of_every_kind():
    fleets = [Fleet(seed) for seed in range(200)]
    answers = [
        each.respondent.answer(each.broadcast, each.pose, at_work=each.at_work) for each in fleets
    ]
    seen = {bid.exclusion for answer in answers for bid in answer.bids}

    assert seen >= {"", Exclusion.TYPE, Exclusion.PAYLOAD, Exclusion.CHARGE, Exclusion.SERVICE}


def test_a_robot_that_bids_itself_may_take_part():
    bids = Bids("robot1", 3, 7, (Bid("robot1", "T1", 5.0),), 2)

    assert central().bids(bids, OFFER) is bids


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"cost_model": "cheap"}, "cost_model 'cheap'; allowed: report, energy"),
        ({"aging": 0.0}, "aging 0; allowed: above 0 s"),
        ({"charge": 1.5}, "charge is 1.5; allowed: from 0 to 1"),
        ({"pose": Pose(math.nan, 0.0)}, r"BidBasis.pose \(nan, 0, 0\) is not made of finite"),
        ({"charge": -0.1}, "charge is -0.1; allowed: from 0 to 1"),
        ({"pace": (1.0,)}, "pace"),
        ({"tasks": (("T1", 0), ("T1", 0))}, "a task is on its list twice"),
        ({"tasks": (("T9", 0),)}, "has 'T9' on its list: not a task"),
        ({"tasks": (("T1", 2),)}, "is at step 2 of T1, which has fewer"),
    ],
)
def test_an_invalid_basis_is_refused(change, words):
    answer = Bids("robot1", 3, 7, (), 2, replace(BASIS, **change))

    office = central(OFFER.tasks[0][0])
    with pytest.raises(BidRefusedError, match=words):
        office.bids(answer, OFFER)
    with pytest.raises(BidRefusedError, match=words):
        office.check("robot1", answer.basis)  # for a plan


def found_bidders(*names):
    """Return a central office that has found robots to bid themselves."""
    office = central()
    for name in names:
        assert office.has_found_bidder(Bids(name, 3, 7, (), 2))
    return office


def test_a_robot_is_found_to_bid_itself_once():
    assert not found_bidders("robot1").has_found_bidder(Bids("robot1", 3, 7, (), 2))
    assert not central().has_found_bidder(Bids("robot1", 3, 7, (), 2, BASIS))


def test_robots_that_bid_themselves_are_sent_the_most_urgent_tasks_as_far_as_bids_are_asked_for():
    tasks = tuple((Task(f"T{n}", TaskType.GA, (Pose(5.0, 0.0),), n % 2), 0) for n in range(3000))
    fleet = frozenset({"robot1", "robot2", "robot3"})
    office = found_bidders("robot2", "robot3")

    offer, question = office.questions(replace(OFFER, tasks=tasks), fleet, fleet | {"defect"})

    assert set(offer.asked) == {"robot2", "robot3"}
    assert len(offer.tasks) == 1000
    assert {task.priority for task, _ in offer.tasks} == {1}
    assert set(question.asked) == {"robot1", "defect"}
    assert question.tasks == ()


def test_a_robot_that_was_out_of_service_is_asked_anew_what_its_bids_are_made_from():
    office = found_bidders("robot1")
    office.questions(OFFER, frozenset(), ONE)

    (question,) = office.questions(OFFER, ONE, ONE)

    assert question.basis


def test_a_basis_is_refused_of_a_robot_that_was_asked_for_bids():
    with pytest.raises(BidRefusedError, match="robot1 tells a basis of bids; it was asked for"):
        found_bidders("robot1").check("robot1", BASIS)
