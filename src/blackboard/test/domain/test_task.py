# SPDX-License-Identifier: BSD-3-Clause
"""What can be asked for, what cannot, and the steps that a task is made of."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.costing.grid_path_lengths import GridPathLengths
from blackboard.domain.task import (
    MAX_GOALS,
    TRANSITIONS,
    StepKind,
    Task,
    TaskEvent,
    TaskState,
    TaskType,
    analyze_task,
    goal_name,
    load_during,
    split_task,
    step_to_resume,
    unused_goals,
    used_goals,
)
from blackboard.errors import TaskRefusedError
from hive_common.grid_map import GridMap
from hive_common.pose import Pose

A, B, C = Pose(1.0, 2.0, 0.5), Pose(5.0, 2.0), Pose(5.0, 6.0)
MOVE, PICK, PLACE = StepKind.MOVE, StepKind.PICK, StepKind.PLACE
GOOD = Task("T1", TaskType.GPAB, (A, B), priority=5, payload=2.0)

# Written anew from the words of the states and events, and not from the code: one line for each
# state, one letter for each event of ASSIGN, START, FINISH, RELEASE, FAIL, CANCEL. The letter is
# the initial of the next state (X for CANCELLED); a dot is for what changes nothing.
LETTERS = {
    "W": TaskState.WAITING,
    "A": TaskState.ASSIGNED,
    "S": TaskState.STARTED,
    "D": TaskState.DONE,
    "F": TaskState.FAILED,
    "X": TaskState.CANCELLED,
    ".": None,
}
EXPECTED = {
    TaskState.WAITING: "A.D.FX",
    TaskState.ASSIGNED: ".SDWFX",
    TaskState.STARTED: ".SDWFX",
    TaskState.DONE: "......",
    TaskState.REJECTED: "......",
    TaskState.CANCELLED: "......",
    TaskState.FAILED: "......",
}


def hall():
    """Return a map of 10 m x 10 m from (0, 0) with a wall from x = 4 m to 5 m."""
    blocked = np.zeros((20, 20), dtype=bool)
    blocked[:, 8:10] = True
    return GridPathLengths(GridMap.of_blocked(blocked, 0.5))


def refusal(task, path_lengths=None):
    """Return why a task is refused."""
    with pytest.raises(TaskRefusedError) as refused:
        analyze_task(task, path_lengths or EuclideanLengths())
    return str(refused.value)


@pytest.mark.parametrize("state", TaskState)
@pytest.mark.parametrize("event", TaskEvent)
def test_every_state_answers_every_event_as_written_down_elsewhere(state, event):
    letter = EXPECTED[state][list(TaskEvent).index(event)]

    assert TRANSITIONS[state][event] is LETTERS[letter]


def test_the_transition_table_has_no_gaps_and_nothing_else():
    assert set(TRANSITIONS) == set(TaskState)
    assert all(set(answers) == set(TaskEvent) for answers in TRANSITIONS.values())


def test_done_and_all_that_follows_is_terminal():
    terminal = {state for state in TaskState if state.is_terminal}

    assert terminal == {
        TaskState.DONE,
        TaskState.REJECTED,
        TaskState.CANCELLED,
        TaskState.FAILED,
    }


def test_a_good_task_passes():
    analyze_task(GOOD, hall())


@pytest.mark.parametrize(
    ("change", "named", "allowed"),
    [
        ({"id": ""}, "0 characters", "1 to 64"),
        ({"id": "x" * 65}, "65 characters", "1 to 64"),
        ({"id": "two words"}, "'two words'", "leave them out"),
        ({"id": "line\nbreak"}, r"'line\nbreak'", "leave them out"),
        ({"id": "nul\0"}, r"'nul\x00'", "leave them out"),
        ({"type": 4}, "type 4", "GA=0, GAB=1, GPA=2, GPAB=3"),
        ({"type": 255}, "type 255", "GA=0, GAB=1, GPA=2, GPAB=3"),
        ({"priority": 11}, "priority 11", "from 0 to 10"),
        ({"priority": -1}, "priority -1", "from 0 to 10"),
        ({"payload": -0.5}, "payload -0.5 kg", "from 0 to 1e+06 kg"),
        ({"payload": math.nan}, "payload nan kg", "from 0 to 1e+06 kg"),
        ({"payload": math.inf}, "payload inf kg", "from 0 to 1e+06 kg"),
        ({"payload": 1e308}, "payload 1e+308 kg", "from 0 to 1e+06 kg"),
        (
            {"goals": (Pose(1e308, 2.0), A)},
            "goal A (1e+308, 2, 0)",
            "from the origin than 100 km",
        ),
        ({"goals": (Pose(2.0, -100001.0), A)}, "goal A (2, -100001, 0)", "100 km"),
        ({"goals": (Pose(2.0, 2.0, 1e308), A)}, "goal A (2, 2, 1e+308)", "more than 1000 rad"),
        ({"frame": "odom"}, "frame 'odom'", "allowed: map"),
        ({"goals": (A,)}, "GPAB has 1 goals", "2 to 100"),
        ({"goals": (A,) * (MAX_GOALS + 1)}, "GPAB has 101 goals", "2 to 100"),
        ({"type": TaskType.GA, "goals": ()}, "GA has 0 goals", "1 to 100"),
        ({"type": TaskType.GPA, "goals": ()}, "GPA has 0 goals", "1 to 100"),
        ({"type": TaskType.GAB, "goals": (A,)}, "GAB has 1 goals", "2 to 100"),
        ({"goals": (Pose(math.nan, 0.0), B)}, "goal A (nan, 0, 0)", "finite numbers"),
        ({"goals": (A, Pose(0.0, math.inf))}, "goal B (0, inf, 0)", "finite numbers"),
        ({"goals": (A, Pose(1.0, 1.0, -math.inf))}, "goal B (1, 1, -inf)", "finite numbers"),
        ({"goals": (A, Pose(11.0, 2.0))}, "goal B (11.00, 2.00)", "from (0.00, 0.00) to (10.00,"),
        ({"goals": (Pose(4.5, 2.0), B)}, "goal A (4.50, 2.00)", "choose a free place"),
    ],
)
def test_a_bad_task_is_refused_with_its_value_and_what_is_allowed(change, named, allowed):
    reason = refusal(replace(GOOD, **change), hall())

    assert named in reason
    assert allowed in reason


@given(
    st.builds(
        Task,
        id=st.text(max_size=70),
        type=st.integers(0, 255),
        goals=st.lists(st.builds(Pose, st.floats(), st.floats(), st.floats()), max_size=4).map(
            tuple
        ),
        priority=st.integers(0, 255),
        payload=st.floats(),
        frame=st.text(max_size=5),
    )
)
def test_whatever_is_posted_is_either_taken_or_refused_in_words(task):
    try:
        analyze_task(task, hall())
    except TaskRefusedError as error:
        answer = str(error)
    else:
        answer = split_task(task)

    assert answer


def test_a_task_without_a_frame_means_the_map():
    named = replace(GOOD, frame="map")
    analyze_task(named, EuclideanLengths())

    assert GOOD.asks_the_same_as(named)


def test_when_a_task_was_posted_does_not_change_what_it_asks():
    assert GOOD.asks_the_same_as(replace(GOOD, posted=99.0))


@pytest.mark.parametrize(
    "change",
    [
        {"type": TaskType.GAB},
        {"goals": (B, A)},
        {"priority": 6},
        {"payload": 2.5},
        {"id": "T2"},
        {"no_split": True},
    ],
)
def test_anything_else_changes_what_a_task_asks(change):
    assert not GOOD.asks_the_same_as(replace(GOOD, **change))


@pytest.mark.parametrize(
    ("kind", "goals", "steps"),
    [
        (TaskType.GA, (A,), [(MOVE, A)]),
        (TaskType.GA, (A, B), [(MOVE, A)]),
        (TaskType.GAB, (A, B), [(MOVE, A), (MOVE, B)]),
        (TaskType.GAB, (A, B, C), [(MOVE, A), (MOVE, B), (MOVE, C)]),
        (TaskType.GPA, (A,), [(MOVE, A), (PICK, A)]),
        (TaskType.GPA, (A, B), [(MOVE, A), (PICK, A)]),
        (TaskType.GPAB, (A, B), [(MOVE, A), (PICK, A), (MOVE, B), (PLACE, B)]),
        (TaskType.GPAB, (A, B, C), [(MOVE, A), (PICK, A), (MOVE, B), (MOVE, C), (PLACE, C)]),
    ],
)
def test_a_task_is_split_into_its_steps_in_order(kind, goals, steps):
    split = split_task(replace(GOOD, type=kind, goals=goals))

    assert [(step.kind, step.goal) for step in split] == steps
    assert {step.task_id for step in split} == {"T1"}


def test_only_the_arm_s_steps_say_what_they_handle():
    handled = [step.payload for step in split_task(GOOD)]

    assert handled == [0.0, 2.0, 0.0, 2.0]


@pytest.mark.parametrize(
    ("kind", "goals", "loads"),
    [
        (TaskType.GA, (A,), [2.0]),
        (TaskType.GAB, (A, B, C), [2.0, 2.0, 2.0]),
        (TaskType.GPA, (A,), [0.0, 0.0]),
        (TaskType.GPAB, (A, B), [0.0, 0.0, 2.0, 2.0]),
        (TaskType.GPAB, (A, B, C), [0.0, 0.0, 2.0, 2.0, 2.0]),
    ],
)
def test_what_is_on_board_during_each_step_follows_from_who_loads(kind, goals, loads):
    task = replace(GOOD, type=kind, goals=goals)

    assert [load_during(task, step) for step in range(len(split_task(task)))] == loads


@pytest.mark.parametrize(
    ("change", "is_one"),
    [({}, True), ({"posted": 0.0}, True), ({"posted": 8.0}, False), ({"id": "T9"}, False)],
)
def test_a_later_task_with_the_same_id_has_a_load_of_its_own(change, is_one):
    first = replace(GOOD, posted=7.0)
    _, picks, *_ = split_task(first)
    *_, places = split_task(replace(first, **change))

    assert places.handles_the_load_of(picks) is is_one
    assert picks.handles_the_load_of(places) is is_one


def test_goals_that_a_type_does_not_visit_are_named():
    task = replace(GOOD, type=TaskType.GPA, goals=(A, B, C))

    assert used_goals(task) == (A,)
    assert unused_goals(task) == "GPA goes to A only; the 2 goals after it are not used"
    assert not unused_goals(GOOD)


@pytest.mark.parametrize(
    ("kind", "step"),
    [(TaskType.GA, 1), (TaskType.GAB, 1), (TaskType.GPA, 0), (TaskType.GPAB, 0)],
)
def test_visited_places_stay_visited_but_a_pick_begins_with_the_way_there(kind, step):
    assert step_to_resume(replace(GOOD, type=kind), 1) == step


def test_goals_are_called_by_letters_and_then_by_numbers():
    assert [goal_name(number) for number in (0, 1, 25, 26)] == ["A", "B", "Z", "27"]
