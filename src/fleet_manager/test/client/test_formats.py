# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import math
import re
from pathlib import Path
from string import Formatter
from xml.etree import ElementTree as ET

import pytest

from blackboard.domain.characteristics import RobotState
from blackboard.domain.task import TaskState, TaskType
from fleet_manager.desk import formats, words
from fleet_manager.desk.authority import Standing
from fleet_manager.desk.natural import next_task_id, padded
from fleet_manager.desk.outbox import Answer
from fleet_manager.desk.places import Place, place_of
from fleet_manager.desk.words import WORDS, text
from hive_common.pose import Pose
from hive_common.resources import package_folder

SOURCES = Path(words.__file__).parents[1]
FORMS = sorted((package_folder("fleet_manager") / "resource").glob("*.ui"))


BUILT = re.compile(
    r"(type|task|robot|sent|authority|log)\.[A-Z]+|goal\.(x|y|heading)|menu\.(as_desktop|light|dark)"
    r"|authority\.(no_)?backup"
)
"""Keys that the code builds from the name of a state or a field."""


def used_keys():
    """Return every key that the code and the forms name in full."""
    code = [path for folder in ("desk", "gui", "ros") for path in (SOURCES / folder).glob("*.py")]
    texts = [path.read_text() for path in (*code, *FORMS) if path.stem != "words"]
    return set(re.findall(r'["\'>]([a-z]+\.[a-zA-Z_]+)["\'<]', "\n".join(texts)))


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_every_text_in_a_form_is_a_key_of_the_words(path):
    texts = [node.text for node in ET.parse(path).iter("string")]  # noqa: S314  (our own)

    assert texts
    assert [key for key in texts if key not in WORDS] == []


def test_every_state_has_its_word():
    kinds = {"task": TaskState, "robot": RobotState, "type": TaskType, "sent": Answer}
    kinds["authority"] = Standing

    missing = {
        f"{kind}.{member.name}"
        for kind, members in kinds.items()
        for member in members
        if f"{kind}.{member.name}" not in WORDS
    }

    assert missing == set()


def test_no_word_is_left_that_nobody_uses():
    unused = {key for key in WORDS if key not in used_keys() and not BUILT.fullmatch(key)}

    assert unused == set()


def test_every_text_can_be_filled():
    for key, words_ in WORDS.items():
        fields = {name for _, name, _, _ in Formatter().parse(words_) if name}
        assert text(key, **dict.fromkeys(fields, 1)), key


@pytest.mark.parametrize(
    ("seconds", "shown"),
    [
        (None, "–"),
        (math.nan, "–"),
        (-5, "0 s"),
        (59.4, "59 s"),
        (59.6, "1 min 00 s"),
        (3600, "1 h 00 min"),
        (90061, "1 d 01 h"),
    ],
)
def test_a_time_span_is_shown_in_the_units_that_matter(seconds, shown):
    assert formats.duration(seconds) == shown


def test_every_number_has_its_unit():
    assert formats.mass(12.5) == "12.5 kg"
    assert formats.mass(math.nan) == "–"
    assert formats.percent(0.874) == "87 %"
    assert formats.position(Pose(1, 2.345)) == "1.00 m, 2.35 m"
    assert formats.degrees(math.pi / 2) == "90°"
    assert formats.charge_used(0.0123) == "0.012 Ah"


def test_names_are_sorted_by_the_numbers_in_them():
    assert sorted(["T10", "T9", "robot2", "T7.10", "T7.9"], key=padded) == [
        "T7.9",
        "T7.10",
        "T9",
        "T10",
        "robot2",
    ]


def test_the_next_id_is_behind_all_that_are_taken():
    assert next_task_id([]) == "T1"
    assert next_task_id(["T3", "T10", "T7.2", "rush"]) == "T11"


def test_a_robot_is_at_the_nearest_place_if_it_is_near_enough():
    places = (Place("dock", Pose(1, 1)), Place("bench", Pose(2, 1)))

    assert place_of(Pose(1.6, 1), places) == "bench"
    assert place_of(Pose(5, 5), places) == ""
    assert place_of(Pose(math.nan, 5), places) == ""
    assert place_of(Pose(1, 1), ()) == ""
