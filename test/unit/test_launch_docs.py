# SPDX-License-Identifier: BSD-3-Clause
"""The text of a launch argument, which `roslaunch --ros-args` shows, says what may be given."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from blackboard.costing.cost import COST_MODELS
from blackboard.domain.settings import DECISIONS, DISTANCES, TRAFFIC
from fleet_manager.config.fleet_file import LOCALIZATIONS, NAVIGATIONS, PROCESSES

ROOT = Path(__file__).resolve().parents[2]
ARGUMENTS = [
    (f"{path.parts[-3]}/{path.stem}", tag)
    for path in sorted(ROOT.glob("src/*/launch/*.launch"))
    for tag in ET.parse(path).getroot().findall("arg")  # noqa: S314  (our own files)
    if tag.get("value") is None
]
NAMED = {
    "cost_model": COST_MODELS,
    "decision": DECISIONS,
    "distance": DISTANCES,
    "localization": LOCALIZATIONS,
    "navigation": NAVIGATIONS,
    "processes": PROCESSES,
    "traffic": TRAFFIC,
}
"""What is allowed for arguments of these names."""


@pytest.mark.parametrize(
    ("file", "tag"),
    [each for each in ARGUMENTS if each[1].get("name") in NAMED],
    ids=lambda each: each if isinstance(each, str) else each.get("name"),
)
def test_every_name_that_is_allowed_stands_in_the_text(file, tag):
    text = set(re.findall(r"\w+", tag.get("doc", "")))

    assert [name for name in NAMED[tag.get("name")] if name not in text] == [], file


def test_an_argument_that_may_be_left_empty_says_that_it_is_optional():
    """`roslaunch --ros-args` lists an argument whose default is empty as required."""
    empty = [(file, tag) for file, tag in ARGUMENTS if tag.get("default") == ""]
    unsaid = [
        f"{file}: {tag.get('name')}"
        for file, tag in empty
        if not tag.get("doc", "").startswith("Optional: ")
    ]

    assert unsaid == []


def test_every_argument_has_a_text():
    assert [f"{file}: {tag.get('name')}" for file, tag in ARGUMENTS if not tag.get("doc")] == []
