# SPDX-License-Identifier: BSD-3-Clause
"""The numbers on the wire are the numbers of the cores; messages are read as text."""

import re
from pathlib import Path

import pytest

from blackboard.domain.bid import MAX_COST
from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState, TaskType

MESSAGES = Path(__file__).resolve().parents[2] / "src/blackboard/msg"
CONSTANT = re.compile(r"^uint8 (?P<name>[A-Z_]+) *= *(?P<value>\d+)", re.MULTILINE)


def constants(message):
    """Return name and number of the constants of a message file."""
    text = (MESSAGES / f"{message}.msg").read_text()
    return {match["name"]: int(match["value"]) for match in CONSTANT.finditer(text)}


@pytest.mark.parametrize(
    ("message", "enum"),
    [("TaskState", TaskState), ("RobotStatus", RobotState)],
)
def test_the_states_of_a_message_are_those_of_the_core(message, enum):
    assert constants(message) == {member.name: member.value for member in enum}


def test_the_task_types_of_the_message_are_those_of_the_core():
    orders = {"ASSIGN", "TAKE_BACK", "HAND_BACK", "HAND_BACK_UNBEGUN", "FORGOTTEN"}
    types = {name: value for name, value in constants("TaskMsg").items() if name not in orders}

    assert types == {member.name: member.value for member in TaskType}


def test_terminal_states_are_marked_in_the_message():
    text = (MESSAGES / "TaskState.msg").read_text()
    marked = set(re.findall(r"^uint8 ([A-Z]+) .*\(terminal\)", text, re.MULTILINE))

    assert marked == {state.name for state in TaskState if state.is_terminal}


def test_the_highest_cost_of_the_message_is_that_of_the_core():
    text = (MESSAGES / "TaskCost.msg").read_text()

    assert float(re.search(r"^float64 MAX_COST *= *(\S+)", text, re.MULTILINE)[1]) == MAX_COST


@pytest.mark.parametrize("path", sorted(MESSAGES.glob("*.msg")), ids=lambda path: path.name)
def test_a_message_says_what_it_is_for_and_who_publishes_it(path):
    purpose, publisher = path.read_text().splitlines()[:2]

    assert re.match(r"# \w.*\.$", purpose)
    assert publisher.startswith("# Published by: ")
