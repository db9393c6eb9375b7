# SPDX-License-Identifier: BSD-3-Clause
"""What all architectures share: places, bodies, and the ledger of what was really done."""

import pytest

from blackboard.costing.cost import friction_force
from blackboard.domain.task import StepKind, Task, TaskType, split_task
from hive_lab.architectures.grounds import NodePathLengths, poses
from hive_lab.architectures.hall_trial import HallTrial
from hive_lab.architectures.ledger import Ledger
from hive_lab.architectures.trial import WARM_UP

A, B, C = poses(3)
GO = Task("T1", TaskType.GAB, (A, B), payload=10.0)


def trial_robot():
    """Return a trial whose operator has posted nothing yet, and its first robot."""
    trial = HallTrial(2, seed=1, posts=[(0.0, GO)])
    trial.boot("robot1")
    return trial, trial.robots["robot1"]


@pytest.fixture
def robot():
    """Return `trial_robot()`."""
    return trial_robot()


def test_a_node_pays_once_for_the_way_to_a_place():
    bills = []
    lengths = NodePathLengths(0.3, bills.append)

    lengths.length(A, B)
    lengths.length(C, B)
    lengths.length(A, C)
    lengths.length(B, A)

    assert len(bills) == 2
    assert all(bill > 0.0 for bill in bills)


def test_every_place_costs_what_its_own_distance_field_takes():
    bills = []
    list(NodePathLengths(0.3, bills.append).columns([A], poses(40)))

    assert len(bills) == 40
    assert min(bills) > 0.1 * max(bills)


def test_every_node_pays_for_itself():
    bills = []
    for _ in range(2):
        list(NodePathLengths(0.3, bills.append).columns([A], [B, C]))

    assert len(bills) == 4
    assert bills[:2] == bills[2:]


def drawn_in(moves, duration, goal):
    """Return what a robot draws in a time [s] in which it drives from its start to a goal."""
    body = moves.characteristics
    way = NodePathLengths(body.radius, lambda _: None).length(poses(41)[40], goal)
    friction = friction_force(body.friction_coefficient, body.mass + 10.0)
    return body.idle_power * duration + friction * way


def test_a_drive_draws_what_friction_takes_with_the_load_on_board(robot):
    trial, moves = robot
    ended = []
    trial.network.run(0.5)
    before = moves.body.drawn

    moves.body.start(split_task(GO)[0], ended.append)
    trial.network.run(200.0)

    assert len(ended) == 1
    assert moves.body.pose == A
    assert moves.body.drawn - before == pytest.approx(drawn_in(moves, 200.0, A))
    assert moves.body.battery.level == moves.body.battery.measured.level < 1.0


def time_to_drive(robot, *stops):
    """Return how long a drive takes that is interrupted at some times, for 100 s each."""
    trial, moves = robot
    network, ended = trial.network, []
    begun = network.now
    moves.body.start(split_task(GO)[0], lambda _: ended.append(network.now))
    for at in stops:
        network.run(begun + at)
        moves.body.cancel()
        network.run(network.now + 100.0)
        assert moves.body.pose != A
        moves.body.start(split_task(GO)[0], lambda _: ended.append(network.now))
    network.run(network.now + 200.0)
    assert moves.body.pose == A
    (end,) = ended
    return end - begun


def test_a_drive_that_is_interrupted_goes_on_where_it_stopped():
    in_one_go = time_to_drive(trial_robot())

    assert time_to_drive(trial_robot(), 5.0, 110.0) == pytest.approx(in_one_go + 200.0)


def test_a_drive_to_another_goal_begins_anew():
    trial, moves = trial_robot()
    first, second = split_task(GO)
    ended = []
    moves.body.start(first, lambda _: ended.append(first))
    trial.network.run(5.0)
    moves.body.cancel()

    moves.body.start(second, lambda _: ended.append(second))
    trial.network.run(205.5)

    assert moves.body.pose == B
    assert ended == [second]
    assert moves.body.drawn == pytest.approx(drawn_in(moves, 205.0, B))


def test_a_body_whose_process_is_killed_stands_still(robot):
    trial, moves = robot
    start, ended = moves.body.pose, []
    moves.body.start(split_task(GO)[0], ended.append)

    trial.kill("robot1")
    trial.network.run(200.0)

    assert moves.body.pose == start
    assert not ended


def test_a_task_is_done_with_its_last_step_and_twice_with_its_second_last_step():
    ledger = Ledger([GO])
    ledger.posted["T1"] = 1.0
    first, last = split_task(GO)

    ledger.note(first, 5.0)
    assert not ledger.is_all_done

    ledger.note(last, 8.0)
    ledger.note(first, 9.0)
    assert ledger.is_all_done
    assert ledger.times_to_done == [7.0]
    assert ledger.done_twice == 0

    ledger.note(last, 11.0)
    assert ledger.done_twice == 1


def test_parts_of_a_task_that_was_split_are_followed_and_do_not_count_as_tasks():
    ledger = Ledger([GO])
    part = Task("T1.1", TaskType.GAB, (A, B), payload=4.0)
    last = split_task(part)[-1]
    assert ledger.load_during(last) == 0.0

    ledger.learn_parts([part])
    ledger.note(last, 5.0)
    ledger.note(last, 6.0)

    assert ledger.load_during(last) == 4.0
    assert ledger.done_twice == 1
    assert not ledger.is_all_done


def test_a_load_is_on_board_from_its_pick_on():
    task = Task("T1", TaskType.GPAB, (A, B), payload=0.4)
    ledger = Ledger([task])

    loads = [(step.kind, ledger.load_during(step)) for step in split_task(task)]

    moves = [load for kind, load in loads if kind is StepKind.MOVE]
    assert moves == [0.0, 0.4]


def test_all_architectures_get_the_same_tasks_at_the_same_times():
    first, second, other = HallTrial(3, seed=1), HallTrial(3, seed=1), HallTrial(3, seed=2)

    assert first.posts == second.posts
    assert first.posts != other.posts
    assert {0.0, 60.0} <= {at for at, _ in first.posts}


class Deaf:
    """An architecture of two nodes, which do nothing."""

    coordinator = "a"

    def __init__(self, receivers):
        self._receivers = receivers

    def receivers(self, _random):
        return self._receivers


def test_the_operator_turns_to_another_node_when_the_first_does_not_answer():
    trial = HallTrial(2, seed=1)
    heard = []
    for name in ("a", "b"):
        trial.boot(name).subscribe("new_task", lambda task, name=name: heard.append((name, task)))

    trial.begin(Deaf(("a", "b")))
    trial.network.run(WARM_UP + 20.0)

    first = [name for name, task in heard if task.id == "T1"]
    assert first[:10] == ["a"] * 5 + ["b"] * 5
