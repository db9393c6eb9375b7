# SPDX-License-Identifier: BSD-3-Clause
"""What a plan is made of: robots and tasks as numbers."""

from dataclasses import replace

import numpy as np
import pytest

from blackboard.auction.search.survey import BATCH, Situation, Surveyed, survey
from blackboard.costing.bid_basis import BidBasis
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.path_lengths import FieldJob, Wanted
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT

HERE = Pose(0.0, 0.0)
QUICK, SLOW = (0.0, 1.0, 0.0), (4.0, 3.0, 0.0)  # [s], [s/m], [s/rad]


def surveyed(*bases, tasks=((10.0, 0.0),)):
    """Return the problem of robots that all stand at one place, and tasks to go somewhere."""
    records = [
        TaskRecord(Task(f"T{number}", TaskType.GA, (Pose(*place),)))
        for number, place in enumerate(tasks)
    ]
    named = {f"robot{number}": basis for number, basis in enumerate(bases, start=1)}
    situation = Situation(
        named, records, lambda _id: None, lambda _radius: EuclideanLengths(), 0.0
    )
    return next(piece for piece in survey(situation) if isinstance(piece, Surveyed))


def basis(pace=(), **changes):
    body = replace(SMALL_ROBOT, **changes)
    return BidBasis(body, "latency", 120.0, HERE, 1.0, pace=pace)


def times(found):
    """Return how long each robot takes for the first task [s]."""
    return [found.problem.times(robot, (0,))[0] for robot in range(len(found.robots))]


def test_robots_of_one_model_count_with_their_mean_pace():
    found = surveyed(basis(QUICK), basis(SLOW))

    assert times(found) == [pytest.approx(2.0 + 10.0 * 2.0)] * 2


def test_robots_of_other_models_keep_their_own_pace():
    found = surveyed(basis(QUICK), basis(SLOW, mass=60.0))

    assert times(found) == pytest.approx([10.0, 34.0])


def test_a_robot_may_do_what_its_model_can():
    found = surveyed(basis(), basis(capabilities=frozenset({TaskType.GPA})))

    assert found.problem.able.tolist() == [[True], [False]]


def test_a_robot_that_tells_why_it_takes_nothing_is_left_out():
    found = surveyed(basis(), replace(basis(), refusal="it charges"))

    assert found.robots == ["robot1"]


def test_a_robot_with_little_charge_may_work_for_a_short_time_only():
    full, low = basis(), replace(basis(), charge=0.12)
    found = surveyed(full, low, tasks=[(5000.0, 0.0)])

    assert found.problem.most[1] < found.problem.most[0]
    assert np.isfinite(found.problem.most[1])


def test_the_margin_of_its_predictions_makes_that_time_shorter():
    learned = (2.0, 1.4, 0.6, 1.0, 1.0, 1.0, 1.0, 0.0)
    plain, careful = (
        replace(basis(mass=mass), charge=0.12, pace=(*learned, margin, 9.0))
        for mass, margin in ((50.0, 0.0), (50.001, 1.0))
    )
    found = surveyed(plain, careful, tasks=[(5000.0, 0.0)])

    assert found.problem.most[1] == pytest.approx(found.problem.most[0] / 2.0, rel=1e-3)


class FarLengths(EuclideanLengths):
    """Straight lines to places that somebody else has to look up first.

    Attributes:
        known: The ways that were looked up.
        asked: How many ways were wanted, each time.
    """

    def __init__(self):
        self.known, self.asked = [], []

    def wanted(self, ways):
        new = [list(way) for way in ways if list(way) not in self.known]
        if not new:
            return None
        self.asked.append(len(new))
        return Wanted(FieldJob(None, new), self.known.extend)


def far(answers, bases, records, listed=()):
    """Survey with path lengths that are looked up, or not; return them and what was found."""
    lengths, found = FarLengths(), None
    on_list = {record.task.id: record for record in listed}
    situation = Situation(bases, records, on_list.get, lambda _radius: lengths, 0.0)
    for piece in survey(situation):
        if isinstance(piece, Wanted):
            piece.keep(piece.job.goals if answers else [])
        else:
            found = piece
    return lengths, found


def go_there(number):
    return TaskRecord(Task(f"T{number}", TaskType.GAB, (Pose(number, 1.0), Pose(number, 9.0))))


@pytest.mark.parametrize("answers", [True, False])
def test_whether_paths_were_looked_up_before_changes_no_problem(answers):
    records = [go_there(number) for number in range(2 * BATCH + 1)]
    bases = {"robot1": basis(), "robot2": basis(mass=60.0)}
    lengths, found = far(answers, bases, records)
    straight = Situation(bases, records, lambda _id: None, lambda _r: EuclideanLengths(), 0.0)
    plain = next(piece for piece in survey(straight) if isinstance(piece, Surveyed))

    asked = [BATCH, BATCH, 1]
    assert lengths.asked == (asked if answers else np.repeat(asked, 2).tolist())
    np.testing.assert_array_equal(found.problem.leg, plain.problem.leg)
    np.testing.assert_array_equal(found.problem.own, plain.problem.own)


def test_ways_of_tasks_that_robots_do_before_and_to_chargers_are_looked_up_first():
    begun, charger = go_there(7), Pose(3.0, 3.0)
    busy = replace(basis(), at_work=True, tasks=(("T7", 1), ("T1", 0)), chargers=(charger,))
    out = replace(basis(), refusal="it charges", tasks=(("T8", 0),))
    lengths, _ = far(True, {"a": busy, "b": out}, [go_there(1)], [begun, go_there(1), go_there(8)])

    assert lengths.asked == [2, 1]
    assert lengths.known == [
        [Pose(7.0, 9.0)],
        [charger],
        [Pose(1.0, 1.0), Pose(1.0, 9.0)],
    ]


def test_a_task_whose_load_is_to_be_put_down_next_is_in_no_plan():
    task = Task("T1", TaskType.GPAB, (Pose(5.0, 0.0), Pose(9.0, 0.0)))
    records = [TaskRecord(task, TaskState.ASSIGNED, "robot1", 3)]
    situation = Situation(
        {"robot1": basis()}, records, lambda _: None, lambda _radius: EuclideanLengths(), 0.0
    )

    assert not [piece for piece in survey(situation) if isinstance(piece, Surveyed)]


def test_a_survey_without_a_map_is_done_in_slices_too():
    tasks = [(float(n), 0.0) for n in range(100)]
    records = [TaskRecord(Task(f"T{n}", TaskType.GA, (Pose(*at),))) for n, at in enumerate(tasks)]
    named = {f"robot{n}": basis() for n in range(20)}
    lengths = EuclideanLengths()
    situation = Situation(named, records, lambda _: None, lambda _radius: lengths, 0.0)

    pieces = [piece for piece in survey(situation) if isinstance(piece, float)]

    assert sum(pieces) > 100 * 120 * 1e-7
    assert max(pieces) < 0.01
