# SPDX-License-Identifier: BSD-3-Clause
"""How plans are made in slices, and what is done beside the leader."""

import numpy as np
import pytest

from blackboard.auction.central import Central
from blackboard.auction.plan_maker import LONGEST, TICK, PlanMaker
from blackboard.auction.search.fields import time_for
from blackboard.auction.step import MakePlan
from blackboard.costing.bid_basis import BidBasis
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskType
from hive_common.grid_map import GridMap
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT
from hive_lab.virtual.inline_searcher import InlineSearcher
from hive_lab.virtual.network import Network, NetworkTalker

TASKS = 60


class Searcher(InlineSearcher):
    """A searcher of which fields can be lost.

    Attributes:
        asked: For how many fields it was asked, each time.
        waits: For how long it had nothing to do between two times [s].
        is_deaf: Whether it never answers when it is asked for fields.
        has_failed: Whether it has no answer to that.
    """

    def __init__(self, clock):
        super().__init__(clock)
        self.asked, self.is_deaf, self.has_failed = [], False, False
        self.waits, self._done_at = [], None

    def fields(self, job, done):
        self.asked.append(len(job.goals))
        if self._done_at is not None:
            self.waits.append(self._clock.now() - self._done_at)
        self._done_at = self._clock.now() + time_for(job)
        if self.has_failed:
            self._tell(0.001, done, None)
        elif not self.is_deaf:
            super().fields(job, done)


class Leader:
    """A plan maker of a leader in an empty hall, and the plans that it has made."""

    def __init__(self):
        self.network = Network()
        talker = self.talker = NetworkTalker(self.network, "leader")
        self.searcher = Searcher(talker)
        self.path_lengths = GridPathLengths(
            GridMap.of_blocked(np.zeros((80, 160), dtype=bool), 0.1), SMALL_ROBOT.radius
        )
        central = Central(lambda _id: None, lambda _radius: self.path_lengths, talker.date, 2000)
        self.plans = []
        self.maker = PlanMaker(
            talker, central, "waiting", self.searcher, self.plans.append, lambda: None
        )

    def plan(self):
        """Begin a plan of tasks at places that nobody has asked for before."""
        places = [Pose(1.0 + 0.2 * n, 1.0 + n % 3) for n in range(TASKS)]
        records = [
            TaskRecord(Task(f"T{n}", TaskType.GA, (place,))) for n, place in enumerate(places)
        ]
        basis = BidBasis(SMALL_ROBOT, "latency", 120.0, Pose(5.0, 5.0), 1.0)
        self.maker.begin(MakePlan({"robot1": basis}, tuple(records), False, (1, 1, 1)))


@pytest.fixture
def leader():
    return Leader()


def test_fields_of_new_goals_are_computed_beside_the_leader(leader):
    leader.plan()
    leader.network.run(3.0)

    assert leader.searcher.asked == [25, 25, 10]
    assert leader.searcher.waits == pytest.approx([0.0, 0.0])
    assert len(leader.plans[0].places) == TASKS


def test_known_goals_ask_for_nothing(leader):
    for _ in range(2):
        leader.plan()
        leader.network.run(3.0)

    assert len(leader.plans) == 2
    assert len(leader.searcher.asked) == 3


def test_without_the_process_the_leader_computes_fields_itself_in_slices(leader):
    leader.plan()
    leader.network.run(3.0)
    leader.path_lengths.use(GridMap.of_blocked(np.zeros((80, 160), dtype=bool), 0.1))
    leader.searcher.has_failed = True
    leader.plan()
    began = leader.network.now
    while len(leader.plans) == 1:
        leader.network.run(TICK)

    assert leader.plans[1].places == leader.plans[0].places
    assert leader.network.now - began > TASKS * TICK


def test_fields_for_a_plan_that_was_dropped_are_not_waited_for(leader):
    leader.searcher.is_deaf = True
    leader.plan()
    leader.network.run(TICK)
    leader.maker.drop()
    leader.searcher.is_deaf = False
    leader.plan()
    leader.network.run(3.0)

    assert len(leader.plans[0].places) == TASKS


def test_fields_that_never_come_end_the_plan_and_tasks_are_auctioned(leader):
    leader.searcher.is_deaf = True
    leader.plan()
    leader.network.run(LONGEST + 1.0)

    assert leader.plans[0].places == ()
    assert len(leader.plans[0].left) == TASKS


def test_a_survey_that_fails_leaves_tasks_to_auctions_and_the_log_says_why(leader):
    leader.path_lengths = None
    leader.plan()
    leader.network.run(1.0)

    assert len(leader.plans[0].left) == TASKS
    (warning,) = leader.talker.warnings
    assert warning.startswith("the search for a plan has failed; tasks are auctioned one by one")
    assert "AttributeError" in warning


def test_a_search_whose_answer_makes_no_sense_leaves_tasks_to_auctions(leader):
    leader.searcher.search = lambda _job, done: done(())
    leader.plan()
    leader.network.run(3.0)

    assert len(leader.plans[0].left) == TASKS
