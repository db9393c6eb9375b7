# SPDX-License-Identifier: BSD-3-Clause
"""The page of the test plan and the table of its breaks keep up with the cases."""

import ast
import importlib
import re
import sys
from pathlib import Path

import pytest

from robot_description.models import load_model

ROOT = Path(__file__).resolve().parents[2]
ROSTEST = ROOT / "test" / "rostest"
PAGE = ROOT / "docs" / "test-plan.md"


sys.path.insert(0, str(ROSTEST / "breaks"))
BREAKS = importlib.import_module("hive_breaks").BREAKS
sys.path.pop(0)


def planned_cases():
    """Return the name of every test that carries the mark of the test plan."""
    for path in ROSTEST.glob("cases/plan/plan_*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            marks = [ast.unparse(mark) for mark in getattr(node, "decorator_list", [])]
            if any(mark.startswith("pytest.mark.plan(") for mark in marks):
                yield node.name


@pytest.mark.parametrize("name", sorted(planned_cases()))
def test_every_case_is_on_the_page(name):
    assert f"`{name}`" in PAGE.read_text(encoding="utf-8")


def test_every_case_on_the_page_is_there():
    named = set(re.findall(r"`(test_\w+)`", PAGE.read_text(encoding="utf-8")))

    assert named == set(planned_cases())


@pytest.mark.parametrize("path", sorted(ROSTEST.glob("models/*.yaml")), ids=lambda path: path.stem)
def test_the_robots_of_the_plan_can_be_described(path):
    assert load_model(path).name == path.stem


def test_every_case_has_a_break():
    assert {each.test for each in BREAKS.values()} == set(planned_cases())


@pytest.mark.parametrize("name", BREAKS)
def test_what_a_break_replaces_is_there(name):
    module = BREAKS[name].path.partition(":")[0]
    if ".ros." in module or module.startswith(("roslaunch", "rosbag")):
        pytest.importorskip("blackboard.msg", reason="needs the workspace: ./hive test unit")
    owner, attribute = BREAKS[name].place()

    assert hasattr(owner, attribute)
