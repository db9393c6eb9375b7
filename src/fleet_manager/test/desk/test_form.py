# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import math

import pytest

from blackboard.domain.task import Task, TaskType
from fleet_manager.desk.facts import MapBounds
from fleet_manager.desk.form import (
    GOALS_TAKEN,
    FormText,
    GoalText,
    check,
    goals_needed,
    next_task_id,
    parsed,
    typed_goals,
)
from hive_common.pose import Pose

HERE, THERE = GoalText("3", "4", "90"), GoalText("8.5", "2", "")
LAB = MapBounds(0.0, 0.0, 20.0, 12.0)
NO_NUMBERS = [
    "abc",
    "nan",
    "inf",
    "-inf",
    "1e3",
    "0x10",
    "1_000",
    "1,2,3",
    "٣",
    "½",
    "🤖",
    "x" * 200,
]


def form(**changes):
    filled = {"id": "T1", "type": TaskType.GA, "goals": (HERE, GoalText(), GoalText())}
    return FormText(**(filled | changes))


def test_a_filled_form_becomes_the_task_that_it_says():
    checked = check(form(type=TaskType.GAB, priority="7", payload="2.5", goals=(HERE, THERE)))

    assert checked.mistakes == {}
    goals = (Pose(3.0, 4.0, math.pi / 2), Pose(8.5, 2.0, 0.0))
    assert checked.task == Task("T1", TaskType.GAB, goals, 7, 2.5, "map")


def test_a_comma_is_read_as_a_decimal_point():
    checked = check(form(payload="2,5"))

    assert checked.task.payload == 2.5


def test_a_heading_beyond_half_a_turn_comes_back_within_it():
    checked = check(form(goals=(GoalText("1", "1", "270"),)))

    assert checked.task.goals[0].yaw == pytest.approx(-math.pi / 2)


@pytest.mark.parametrize("kind", TaskType)
def test_every_type_needs_its_first_goals_and_no_others(kind):
    mistakes = check(form(type=kind, goals=(GoalText(), GoalText(), GoalText()))).mistakes

    assert {field[0] for field in mistakes} == set(goals_needed(kind))


@pytest.mark.parametrize("kind", TaskType)
def test_what_stands_in_goals_that_the_type_does_not_take_is_left_out(kind):
    task = check(form(type=kind, goals=(HERE, HERE, HERE))).task

    assert len(task.goals) == len(GOALS_TAKEN[kind])


def test_a_third_goal_that_is_begun_must_be_finished():
    mistakes = check(form(type=TaskType.GAB, goals=(HERE, THERE, GoalText("3", "", "")))).mistakes

    assert list(mistakes) == ["C.y"]


@pytest.mark.parametrize("typed", NO_NUMBERS)
@pytest.mark.parametrize("field", ["priority", "payload", "A.x", "A.y", "A.heading"])
def test_what_is_no_number_is_marked_at_its_field_and_nothing_else(field, typed):
    if field[0] == "A":
        axes = {"x": "1", "y": "1", "heading": "0"} | {field[2:]: typed}
        checked = check(form(goals=(GoalText(**axes),)))
    else:
        checked = check(form(**{field: typed}))

    assert checked.task is None
    assert list(checked.mistakes) == [field]
    assert "is not a number; allowed: " in checked.mistakes[field]
    assert len(checked.mistakes[field]) < 120


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"priority": "11"}, "priority"),
        ({"priority": "-1"}, "priority"),
        ({"priority": "2.5"}, "priority"),
        ({"payload": "-0.1"}, "payload"),
        ({"payload": "9" * 200}, "payload"),
        ({"goals": (GoalText("-0.1", "1"),)}, "A.x"),
        ({"goals": (GoalText("1", "12.01"),)}, "A.y"),
        ({"goals": (GoalText("1", "1", "361"),)}, "A.heading"),
    ],
)
def test_a_number_outside_its_range_is_marked_with_what_is_allowed(changes, field):
    checked = check(form(**changes), bounds=LAB)

    assert checked.task is None
    assert list(checked.mistakes) == [field]
    assert "is outside; allowed: " in checked.mistakes[field]


def test_a_place_outside_the_map_is_told_where_the_map_ends():
    mistakes = check(form(goals=(GoalText("20.5", "1"),)), bounds=LAB).mistakes

    assert mistakes["A.x"] == "20.5 is outside; allowed: 0 to 20 m, the map ends there"


@pytest.mark.parametrize("field", ["id", "priority", "payload"])
def test_an_empty_field_is_marked(field):
    mistakes = check(form(**{field: "  "})).mistakes

    assert list(mistakes) == [field]
    assert mistakes[field].startswith("is empty; allowed: ")


@pytest.mark.parametrize("name", ["T 1", "T7.1", "ü", "🤖", "a/b", "x" * 65, "line\nbreak", "é"])
def test_an_id_that_other_programs_might_stumble_over_is_marked(name):
    mistakes = check(form(id=name)).mistakes

    assert list(mistakes) == ["id"]


def test_a_taken_id_is_marked_and_a_free_one_proposed():
    mistakes = check(form(id="T4"), taken={"T4", "T9"}).mistakes

    assert mistakes == {"id": "T4 is taken already; T10 is free"}


def test_all_mistakes_are_told_at_once():
    wrong = form(id="", priority="high", payload="", goals=(GoalText("", "north"),))

    assert list(check(wrong).mistakes) == ["id", "priority", "payload", "A.x", "A.y"]


@pytest.mark.parametrize(("typed", "number"), [("-1.5", -1.5), ("+2", 2), (".5", 0.5), ("3.", 3)])
def test_plain_decimal_numbers_are_read(typed, number):
    assert parsed(typed) == number


def test_the_next_id_is_behind_all_that_are_taken():
    assert next_task_id([]) == "T1"
    assert next_task_id(["T3", "T10", "T7.2", "rush"]) == "T11"


def test_goals_that_can_be_read_are_known_before_the_form_is_complete():
    goals = (HERE, GoalText("8.5", "", ""), GoalText("1", "2", ""))

    assert typed_goals(form(type=TaskType.GAB, goals=goals)) == {
        "A": Pose(3.0, 4.0, math.pi / 2),
        "C": Pose(1.0, 2.0, 0.0),
    }
    assert typed_goals(form(goals=(GoalText("9" * 400, "2", ""), HERE, HERE))) == {}
