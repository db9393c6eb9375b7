# SPDX-License-Identifier: BSD-3-Clause
"""The pages about the core say what the core does."""

import doctest
import runpy
from pathlib import Path

import pytest

import blackboard.domain.talker as topics
from blackboard.costing.cost import COST_MODELS
from blackboard.domain.task import TRANSITIONS, TaskEvent, TaskState

DOCS = Path(__file__).resolve().parents[2] / "docs"
PROTOCOL = (DOCS / "protocol.md").read_text()
COST_MODEL = (DOCS / "cost-model.md").read_text()
PAGES = runpy.run_path(str(DOCS.parent / "setup/write_parameters.py"))["pages"]()


def rows(page, *heads):
    """Return the cells of the table below a head, row by row."""
    lines = iter(page.splitlines())
    wanted = f"| {' | '.join(heads)} |"
    assert wanted in lines, f"no table with the head {wanted}"
    next(lines)
    table = []
    for line in lines:
        if not line.startswith("|"):
            break
        table.append([cell.strip().strip("`") for cell in line.strip("|").split("|")])
    return table


def test_the_examples_of_the_cost_model_come_out_as_written():
    failed, tried = doctest.testfile(str(DOCS / "cost-model.md"), module_relative=False)

    assert tried > 10
    assert failed == 0


def test_the_cost_models_are_those_there_are():
    named = [cells[0].split("`")[0] for cells in rows(COST_MODEL, "name", "cost", "good for")]

    assert named == list(COST_MODELS)


def test_the_table_of_transitions_is_the_one_that_is_gone_by():
    table = rows(PROTOCOL, "state", *(event.name for event in TaskEvent))
    written = {state: answers for state, *answers in table}

    expected = {
        state.name: [getattr(answers[event], "name", "-") for event in TaskEvent]
        for state, answers in TRANSITIONS.items()
    }
    assert written == expected


def test_the_numbers_of_the_states_are_the_right_ones():
    numbers = rows(PROTOCOL, "state", *(state.name for state in TaskState))[0]

    assert numbers == ["number", *(str(state.value) for state in TaskState)]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.name)
def test_what_users_read_about_parameters_is_what_the_settings_say(path):
    assert path.read_text() == PAGES[path], "run python3 setup/write_parameters.py"


def test_every_topic_of_the_hive_is_explained():
    table = rows(PROTOCOL, "topic", "type", "from", "to", "when")
    written = {cells[0].removeprefix("<robot>/") for cells in table}

    assert written == {each for each in vars(topics).values() if isinstance(each, topics.Topic)}
