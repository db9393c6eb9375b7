# SPDX-License-Identifier: BSD-3-Clause
"""How a task that is too heavy is split, and how the whole follows its parts."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.auction.splitting import (
    progress,
    shares,
    split,
    unfinished_parts,
    unsplit,
    with_wholes,
)
from blackboard.domain.bid import MAX_COST, Bid
from blackboard.domain.record import TaskRecord
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.errors import SplitRefusedError
from hive_common.pose import Pose

A, B = Pose(1.0, 1.0), Pose(3.0, 3.0)
HEAVY = TaskRecord(Task("T7", TaskType.GAB, (A, B), priority=4, payload=50.0))
WAITING, ASSIGNED, STARTED, DONE, _, CANCELLED, FAILED = TaskState


def divide(record=HEAVY, taken=(), missing=(), **most):
    """Split for robots that say what they can carry [kg]."""
    bids = [Bid(name, record.task.id, MAX_COST, most_payload=kg) for name, kg in most.items()]
    return split(record, bids, frozenset(most) | frozenset(missing), taken.__contains__)


def by_id(*records):
    return {record.task.id: record for record in records}


def whole_of(*states, **fields):
    """Return a task as its parts stand."""
    parts = [
        TaskRecord(replace(HEAVY.task, id=f"T7.{n}"), state, parent="T7", **fields)
        for n, state in enumerate(states, start=1)
    ]
    return progress(replace(HEAVY, parts=len(parts)), parts)


@pytest.mark.parametrize(
    ("payload", "capacities", "parts"),
    [
        (50.0, [20.0, 20.0], (16.667, 16.667, 16.666)),
        (40.0, [20.0], (20.0, 20.0)),
        (40.001, [20.0], (13.334, 13.334, 13.333)),
        (15.0, [10.0, 6.0], (9.375, 5.625)),
        (15.0, [6.0, 10.0, 1.0], (9.375, 5.625)),
        (19.0, [10.0, 6.0], (9.5, 9.5)),
    ],
)
def test_the_parts_are_the_fewest_and_fit_as_many_robots_as_possible(payload, capacities, parts):
    assert shares(payload, capacities) == pytest.approx(parts, abs=0.0011)


@given(st.floats(0.01, 1000.0), st.lists(st.floats(0.5, 100.0), min_size=1, max_size=6))
def test_whatever_the_weights_the_parts_add_up_and_can_be_carried(payload, capacities):
    parts = shares(payload, capacities)
    strongest = math.floor(max(capacities) * 1000 + 1e-6) / 1000

    assert payload - 1e-6 <= sum(parts) <= payload + 0.0011
    assert len(parts) == math.ceil(math.ceil(payload * 1000 - 1e-6) / 1000 / strongest - 1e-9)
    assert all(0 < part <= strongest + 1e-9 for part in parts)


def test_a_part_is_the_same_task_with_a_share_of_the_payload():
    whole, *parts = divide(robot1=20.0)

    assert [part.task.id for part in parts] == ["T7.1", "T7.2", "T7.3"]
    assert {part.parent for part in parts} == {"T7"}
    assert {(part.task.goals, part.task.priority) for part in parts} == {((A, B), 4)}
    assert sum(part.task.payload for part in parts) == pytest.approx(50.0)
    assert (whole.parts, whole.steps, whole.step, whole.state) == (3, 3, 0, WAITING)


def test_every_part_can_be_carried_to_the_gram():
    _, *parts = divide(replace(HEAVY, task=replace(HEAVY.task, payload=9.4)), robot1=4.7)

    assert [part.task.payload for part in parts] == [4.7, 4.7]


def test_a_task_that_one_robot_can_carry_is_not_split():
    assert divide(robot1=20.0, robot2=50.0) == ()


def test_a_task_of_which_nobody_can_carry_any_part_is_not_split():
    assert divide(robot1=-1.0) == ()


def test_robots_that_do_no_such_task_do_not_count():
    assert len(divide(robot1=-1.0, robot2=25.0)) == 3


def test_robots_out_of_service_do_not_count():
    bids = [Bid("robot1", "T7", MAX_COST, most_payload=25.0), Bid("defect", "T7", MAX_COST)]
    bids.append(Bid("charging", "T7", MAX_COST, most_payload=100.0))

    assert len(split(HEAVY, bids, frozenset({"robot1"}), set().__contains__)) == 3


def test_while_one_robot_does_not_say_what_it_carries_nothing_is_split():
    with pytest.raises(SplitRefusedError, match="robot2 has not said what it can carry"):
        divide(robot1=20.0, robot2=0.0)


def test_while_one_robot_has_not_answered_nothing_is_split():
    with pytest.raises(SplitRefusedError, match="robot9 has not said what it can carry"):
        divide(robot1=20.0, missing=("robot9",))


def test_a_task_that_is_not_to_be_split_is_not():
    whole = replace(HEAVY, task=replace(HEAVY.task, no_split=True))

    with pytest.raises(
        SplitRefusedError, match=r"robot1 carries most: 20 kg\), and it is not to be"
    ):
        divide(whole, robot1=20.0, robot2=10.0)
    assert divide(whole, robot1=50.0) == ()


@pytest.mark.parametrize(
    ("most", "words"),
    [
        ({"robot1": 20.0}, "3 parts of 16.67 kg, because robot1 carries most, 20 kg"),
        ({"robot1": 30.0, "robot2": 25.0}, "2 parts of 27.27 kg and 22.73 kg, because robot1"),
        (
            {"a": 9.0, "b": 20.0, "c": 21.0, "d": 5.0},
            "3 parts of 9 kg to 21 kg, because c carries",
        ),
        ({"b": 50.0 / 3, "a": 50.0 / 3, "c": 50.0 / 3}, "because a carries most, 16.6667 kg"),
    ],
)
def test_the_whole_says_into_what_it_is_split_and_why(most, words):
    whole, *_ = divide(**most)

    assert whole.division.startswith("split into ")
    assert words in whole.division
    assert whole.reason == f"{whole.division}; 0 of {whole.parts} parts done"


def test_a_task_whose_split_is_undone_is_as_if_it_had_never_been_split():
    whole, *_ = divide(robot1=20.0)

    assert unsplit(whole) == HEAVY


def test_a_hundred_parts_are_the_most():
    heavy = replace(HEAVY, task=replace(HEAVY.task, payload=2000.0))

    assert len(divide(heavy, robot1=20.0)) == 101
    with pytest.raises(SplitRefusedError, match="more than 100 parts of 20 kg"):
        divide(replace(heavy, task=replace(heavy.task, payload=2001.0)), robot1=20.0)


def test_the_id_of_another_task_is_not_taken_for_a_part():
    with pytest.raises(SplitRefusedError, match=r"the id T7\.2 of a part is taken"):
        divide(robot1=20.0, taken=("T7", "T7.2"))


def test_an_id_that_leaves_no_room_for_those_of_the_parts_is_not_split():
    long = replace(HEAVY, task=replace(HEAVY.task, id="T" * 63))

    with pytest.raises(SplitRefusedError, match="longer than 64 characters"):
        divide(long, robot1=20.0)


@pytest.mark.parametrize(
    ("parts", "state", "step"),
    [
        ((WAITING, WAITING), WAITING, 0),
        ((ASSIGNED, WAITING), ASSIGNED, 0),
        ((ASSIGNED, STARTED), STARTED, 0),
        ((DONE, WAITING), STARTED, 1),
        ((DONE, DONE), DONE, 2),
        ((DONE, FAILED), FAILED, 1),
        ((CANCELLED, WAITING), FAILED, 0),
    ],
)
def test_the_state_of_the_whole_follows_its_parts(parts, state, step):
    whole = whole_of(*parts)

    assert (whole.state, whole.step) == (state, step)


def test_the_whole_tells_its_progress():
    assert whole_of(DONE, STARTED, WAITING).reason == "1 of 3 parts done"


def test_a_failed_whole_names_the_part_that_failed():
    whole = whole_of(FAILED, STARTED, reason="no way")

    assert whole.reason == "its part T7.1 failed: no way; parts that have not ended go on"


def test_the_whole_is_done_with_its_last_part():
    assert whole_of(STARTED, STARTED, eta=30.0).eta == 30.0
    assert whole_of(DONE, WAITING).eta == 0.0


def test_an_ended_whole_no_longer_follows_its_parts():
    ended = replace(HEAVY, state=CANCELLED, parts=1)

    assert progress(ended, [replace(HEAVY, state=DONE)]) is ended


def test_the_whole_changes_together_with_its_part():
    whole, first, second = divide(replace(HEAVY), robot1=25.0)
    done = replace(first, state=DONE)

    part_after, whole_after = with_wholes((done,), by_id(whole, first, second))

    assert part_after is done
    assert (whole_after.task.id, whole_after.state, whole_after.step) == ("T7", STARTED, 1)


def test_a_change_that_does_not_show_in_the_whole_leaves_it_unchanged():
    whole, first, second = divide(robot1=25.0)

    waits = replace(first, reason="waits")
    assert with_wholes((waits,), by_id(whole, first, second)) == (waits,)


def test_a_part_that_is_split_again_carries_its_progress_up_to_the_whole():
    whole, first, second = divide(robot1=25.0)
    first, *halves = divide(first, robot1=12.5)
    known = by_id(whole, replace(second, state=DONE), first, *halves)
    ended = tuple(replace(half, state=DONE) for half in halves)

    after = {record.task.id: record.state for record in with_wholes(ended, known)}

    assert after == {"T7.1.1": DONE, "T7.1.2": DONE, "T7.1": DONE, "T7": DONE}


def test_unfinished_parts_are_found_on_every_level():
    whole, first, second = divide(robot1=25.0)
    first, *halves = divide(first, robot1=12.5)
    known = by_id(whole, first, replace(second, state=DONE), *halves)

    left = {record.task.id for record in unfinished_parts(whole, known)}

    assert left == {"T7.1", "T7.1.1", "T7.1.2"}
