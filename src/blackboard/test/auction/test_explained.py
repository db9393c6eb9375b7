# SPDX-License-Identifier: BSD-3-Clause
"""What planned tasks would cost each robot: the bids that the robots would make themselves."""

import math
import random
from dataclasses import asdict, replace

import numpy as np
import pytest

from blackboard.auction.search.explained import Explainer
from blackboard.auction.search.offers import MOST, offers_for
from blackboard.auction.search.planned import planned
from blackboard.auction.search.searcher import Found
from blackboard.auction.search.survey import Situation, Surveyed, survey
from blackboard.costing.bid_basis import BidBasis
from blackboard.costing.bidding import bids_from
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.bid import Exclusion
from blackboard.domain.record import Broadcast, TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

MODELS = {"latency": "waiting", "makespan": "makespan", "energy": "way"}
NO_ARM = replace(SMALL_ROBOT, capabilities=frozenset({TaskType.GA, TaskType.GAB}))


class Hall:
    """Robots with lists, and one task that waits."""

    def __init__(self, *bases, waiting=None, tried=(), lengths=None):
        self.lengths = lengths or EuclideanLengths()
        self.bases = {f"robot{number}": basis for number, basis in enumerate(bases, start=1)}
        task = waiting or Task("T", TaskType.GA, (Pose(10.0, 5.0),))
        self.waiting = TaskRecord(task, tried=tried)
        self.records = {"T": self.waiting}

    def listed(self, name, *tasks, at_work=False):
        """Give a robot its list; it may be at work on the first task of it."""
        for place, task in enumerate(tasks):
            begun = at_work and place == 0
            state = TaskState.STARTED if begun else TaskState.ASSIGNED
            self.records[task.id] = TaskRecord(task, state, name)
        listed = tuple((task.id, 0) for task in tasks)
        self.bases[name] = replace(self.bases[name], tasks=listed, at_work=at_work)
        return self

    def bids(self, taker, measure="waiting"):
        """Return the bids, by robot, if a plan puts the waiting task behind a robot's list."""
        records = [each for each in self.records.values() if each.state is not TaskState.STARTED]
        situation = Situation(
            self.bases, records, self.records.get, lambda _radius: self.lengths, 0.0
        )
        surveyed = next(piece for piece in survey(situation) if isinstance(piece, Surveyed))
        task = surveyed.records.index(self.waiting)
        plan = tuple(
            (*row, task) if name == taker else row
            for name, row in zip(surveyed.robots, surveyed.plan, strict=True)
        )
        offers = offers_for(surveyed.problem, plan, measure)
        found = planned(surveyed, Found(plan, np.inf, 1.0, 1.0, 0.0, offers), measure)
        return {bid.robot_id: bid for bid in found.bids["T"]}

    def own_bid(self, name):
        """Return the bid that a robot would make itself."""
        basis = self.bases[name]
        tasks = [self.records[task_id].task for task_id, _ in basis.tasks]
        offer = Broadcast(1, 1, ((self.waiting.task, 0),))
        bids = bids_from(basis, name, tasks, offer, EuclideanLengths(), 0.0)
        return bids.bids[0]


def basis(model="latency", body=SMALL_ROBOT, **changes):
    return replace(BidBasis(body, model, 120.0, Pose(0.0, 0.0), 1.0), **changes)


def random_task(draw, name):
    kind = draw.choice([TaskType.GA, TaskType.GAB, TaskType.GPAB])
    goals = tuple(Pose(draw.uniform(0, 50), draw.uniform(0, 50)) for _ in range(2))
    return Task(name, kind, goals, draw.choice([0, 0, 5]), draw.choice([0.0, 2.0]))


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("model", MODELS)
def test_a_robot_that_does_not_get_the_task_is_told_with_the_bid_that_it_would_make(model, seed):
    draw = random.Random(seed)
    heavy = replace(SMALL_ROBOT, mass=60.0, max_speed=0.3)
    learned = draw.choice([(), (2.0, 1.4, 0.6, 1.1, 0.8, 1.2, 0.9, 0.5, 0.05, 7.0)])
    hall = Hall(
        basis(model), basis(model, body=heavy, pace=learned), waiting=random_task(draw, "T")
    )
    listed = [random_task(draw, f"L{number}") for number in range(draw.randint(0, 5))]
    listed.sort(key=lambda task: -task.priority)
    hall.listed("robot2", *listed, at_work=draw.random() < 0.5 and bool(listed))

    told, own = hall.bids("robot1", MODELS[model])["robot2"], hall.own_bid("robot2")

    assert told.terms.place == own.terms.place
    assert asdict(told.terms) == pytest.approx(asdict(own.terms))
    assert (told.cost, told.eta) == pytest.approx((own.cost, own.eta))
    assert told.energy_cost == pytest.approx(own.energy_cost)
    assert told.learned_from == own.learned_from
    assert told.duration == pytest.approx(own.duration)
    assert told.formula_duration == pytest.approx(own.formula_duration)
    assert told.formula_energy_cost == pytest.approx(own.formula_energy_cost)


def test_the_robot_that_gets_the_task_is_told_with_the_place_that_it_has():
    near = Task("L", TaskType.GA, (Pose(40.0, 0.0),))
    hall = Hall(basis(), waiting=Task("T", TaskType.GA, (Pose(50.0, 0.0),)))
    hall.listed("robot1", near)

    told, own = hall.bids("robot1")["robot1"], hall.own_bid("robot1")

    assert told.terms.place == 2
    assert asdict(told.terms) == pytest.approx(asdict(own.terms))


def test_a_robot_that_cannot_do_the_task_says_why():
    pick = Task("T", TaskType.GPA, (Pose(10.0, 0.0),), payload=2.0)
    hall = Hall(basis(), basis(body=NO_ARM), basis(refusal="it charges"), waiting=pick)

    bids = hall.bids("robot1")

    assert bids["robot1"].is_able
    assert (bids["robot2"].reason, bids["robot2"].exclusion) == ("does not do GPA", Exclusion.TYPE)
    assert (bids["robot3"].reason, bids["robot3"].exclusion) == ("it charges", Exclusion.SERVICE)


def test_a_robot_whose_charge_does_not_last_says_so():
    far = Task("T", TaskType.GA, (Pose(30_000.0, 0.0),))
    bids = Hall(basis(), basis(charge=0.12), waiting=far).bids("robot1")

    assert bids["robot2"].exclusion == Exclusion.CHARGE


def test_a_robot_that_has_tried_in_vain_says_so():
    bids = Hall(basis(), basis(), tried=("robot2",)).bids("robot1")

    assert bids["robot2"].reason == "has tried it in vain"


def test_a_plan_says_what_it_gains_over_an_auction():
    reasons = {}
    for measure in MODELS.values():
        hall = Hall(basis(), basis())
        situation = Situation(
            hall.bases, [hall.waiting], hall.records.get, lambda _radius: EuclideanLengths(), 0.0
        )
        surveyed = next(piece for piece in survey(situation) if isinstance(piece, Surveyed))
        offers = offers_for(surveyed.problem, ((0,), ()), measure)
        for after in (0.75, 0.999):
            found = Found(((0,), ()), np.inf, 1.0, after, 0.0, offers)
            reasons[measure, after] = planned(surveyed, found, measure).reason

    assert reasons["waiting", 0.75].endswith(", which takes 25% less waiting than by auction")
    assert reasons["way", 0.75].endswith(", which takes 25% less energy than by auction")
    assert reasons["makespan", 0.75].endswith(", which ends 2% earlier than by auction")
    assert reasons["waiting", 0.999] == "planned together with 0 others"


def test_of_a_large_fleet_the_robot_that_gets_a_task_and_the_best_others_are_told():
    places = np.arange(60.0)
    bases = [basis(pose=Pose(place, 0.0)) for place in places]
    tasks = [TaskRecord(Task(f"T{n}", TaskType.GA, (Pose(float(n), 0.0),))) for n in range(60)]
    named = {f"robot{number:02d}": each for number, each in enumerate(bases)}
    situation = Situation(named, tasks, lambda _: None, lambda _radius: EuclideanLengths(), 0.0)
    surveyed = next(piece for piece in survey(situation) if isinstance(piece, Surveyed))
    plan = tuple((59 - robot,) for robot in range(60))

    offers = offers_for(surveyed.problem, plan, "waiting")

    assert offers.robot.shape == (60, MOST // 60)
    assert offers.robot[10, 0] == 49  # has it, though it is far away
    assert 10 in offers.robot[10, 1:]  # stands there


def test_refusals_of_robots_that_take_nothing_are_told_as_far_as_there_is_room():
    named = {f"robot{number:04d}": basis(refusal="it charges") for number in range(MOST)}
    named["robot"] = basis()
    tasks = [TaskRecord(Task(f"T{n}", TaskType.GA, (Pose(float(n), 0.0),))) for n in range(4)]
    situation = Situation(named, tasks, lambda _: None, lambda _radius: EuclideanLengths(), 0.0)
    surveyed = next(piece for piece in survey(situation) if isinstance(piece, Surveyed))
    plan = ((0, 1, 2, 3),)
    offers = offers_for(surveyed.problem, plan, "waiting")

    bids = Explainer(surveyed, Found(plan, np.inf, 1.0, 1.0, 0.0, offers)).bids()

    assert {len(each) for each in bids.values()} == {MOST // 4}
    assert all(any(bid.is_able for bid in each) for each in bids.values())


class Walled(EuclideanLengths):
    """No robot comes across x = 20 m."""

    def lengths(self, starts, goals):
        across = np.array([[(a.x < 20.0) != (b.x < 20.0) for b in goals] for a in starts])
        return np.where(across, np.inf, super().lengths(starts, goals))

    def length_and_delay(self, start, goal):
        return float(self.lengths([start], [goal])[0, 0]), 0.0


def test_a_robot_with_no_path_to_what_it_has_says_so():
    hall = Hall(basis(), basis(), lengths=Walled())
    hall.listed("robot2", Task("L", TaskType.GA, (Pose(40.0, 0.0),)), at_work=True)

    told = hall.bids("robot1")["robot2"]

    assert (told.exclusion, told.reason) == (
        Exclusion.WAY,
        "finds no path to what is on its list",
    )


def test_the_way_of_a_task_before_one_that_cannot_be_reached_is_a_number():
    hall = Hall(basis(), basis(), lengths=Walled())
    hall.listed("robot2", Task("L", TaskType.GA, (Pose(40.0, 0.0),)))

    bids = hall.bids("robot1")

    assert all(math.isfinite(bid.terms.way) for bid in bids.values() if bid.terms)
