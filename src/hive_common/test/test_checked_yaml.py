# SPDX-License-Identifier: BSD-3-Clause
import re
from typing import Annotated, Any

import attrs
import pytest

from hive_common.checked_yaml import error_at, named_at, read_all_mistakes, read_checked
from hive_common.errors import FileError
from hive_common.pose import Pose
from hive_common.structuring import (
    NotAllowedError,
    between,
    listed,
    one_of,
    positive,
    structure,
)


@attrs.frozen(kw_only=True)
class Shelf:
    height: Annotated[float, positive("height [m]", 3)]
    from_: str = "here"


@attrs.frozen(kw_only=True)
class Room:
    kind: Annotated[str, one_of("hall", "office")]
    shelves: Annotated[tuple[Shelf, ...], listed("shelves")] = ()
    door: Pose | None = None
    people: Annotated[int, between(0, 9, "people")] = 0
    lit: bool = True
    size: tuple[float, float] = (1.0, 1.0)

    def __attrs_post_init__(self):
        if self.kind == "office" and not self.lit:
            raise NotAllowedError(["lit"], "an office is lit; remove the key")


@pytest.fixture
def said(tmp_path):
    """Return what is said of a file's text, mistake by mistake, without the folder."""

    def read(text):
        path = tmp_path / "room.yaml"
        path.write_text(text, encoding="utf-8")
        _, mistakes = read_all_mistakes(path, Room)
        return [str(each).removeprefix(f"{tmp_path}/") for each in mistakes]

    return read


def test_a_file_becomes_an_instance_with_numbers_lists_and_poses_of_its_types(tmp_path):
    path = tmp_path / "room.yaml"
    path.write_text("kind: hall\nshelves: [{height: 2, from: x}]\ndoor: [1, 2, 3]\npeople: 2.0\n")

    room = read_checked(path, Room)

    assert room == Room(
        kind="hall", shelves=(Shelf(height=2.0, from_="x"),), door=Pose(1, 2, 3), people=2
    )
    assert isinstance(room.shelves[0].height, float)
    assert isinstance(room.people, int)


def test_every_mistake_is_named_from_the_top_down_with_line_key_value_and_what_is_allowed(said):
    text = (
        "people: -1\nshelves:\n  - {height: 9}\n  - {height: high, depth: 1}\n  - 7\n"
        "door: [1, 2]\nlit: 1\nsize: [1, true]\n"
    )

    assert said(text) == [
        "room.yaml:1: kind: missing; allowed: hall | office",
        "room.yaml:1: people: -1; allowed: people, 0..9",
        "room.yaml:3: shelves[0].height: 9; allowed: height [m], above 0 and at most 3",
        "room.yaml:4: shelves[1].height: 'high'; allowed: height [m], above 0 and at most 3",
        "room.yaml:4: shelves[1].depth: unknown; allowed: the keys height, from",
        "room.yaml:5: shelves[2]: 7; allowed: the keys height, from",
        "room.yaml:6: door: [1, 2]; allowed: a list of 3",
        "room.yaml:7: lit: 1; allowed: true or false",
        "room.yaml:8: size[1]: True; allowed: a number",
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("kind: office\nlit: false", ":2: lit: an office is lit"),
        ("kind: hall\ndoor: null", ":2: door: None; allowed"),
        ("kind: hall\npeople: 2.5", ":2: people: 2.5; allowed"),
        ("kind: hall\nshelves: text", ":2: shelves: 'text'; allowed: a list of shelves"),
        ("kind: hall\nshelves: {a: 1}", ":2: shelves: {'a': 1}; allowed: a list of shelves"),
        ("- kind", ":1: the whole file: ['kind']; allowed: the keys kind, shelves"),
        (f"kind: hall\nsize: [1, {'9' * 400}]", ":2: size[1]: 9999"),
        (f"kind: {'x' * 500}", f"{'x' * 150}"),
        ("kind: hall\n7: seven", ":2: 7: unknown"),
    ],
)
def test_what_does_not_fit_is_said_in_one_line(said, text, words):
    (line,) = said(text)

    assert words in line
    assert "\n" not in line
    assert len(line) < 400


def test_a_mistake_in_a_merged_key_is_said_at_the_mapping_that_merges_it(said):
    (line,) = said("kind: hall\nshelves:\n  - &a {height: 2}\n  - {<<: *a, height: 9}\n")
    assert line.startswith("room.yaml:4: shelves[1].height: 9")

    found = said("kind: hall\nshelves:\n  - &a {height: 9}\n  - {<<: *a, from: x}\n")
    assert [each.split(":")[1] for each in found] == ["3", "4"]


def test_parameters_are_told_the_place_without_a_file():
    with pytest.raises(NotAllowedError, match=r"^shelves\[0\].height: missing; allowed: height"):
        structure({"kind": "hall", "shelves": [{}]}, Room)
    with pytest.raises(NotAllowedError, match=r"^size\[0\]: inf; allowed: a finite number"):
        structure({"kind": "hall", "size": [float("inf"), 1]}, Room)


def test_a_mistake_found_after_reading_is_told_in_the_same_words(tmp_path):
    path = tmp_path / "room.yaml"
    path.write_text("kind: hall\nshelves:\n  - {height: 1}\n")

    error = error_at(path, ("shelves", 0, "height"), "too low")

    assert isinstance(error, FileError)
    assert str(error) == f"{path}:3: shelves[0].height: too low"


@attrs.frozen
class Mix:
    """A file with keys that its reader does not know in advance."""

    weights: dict[str, float]
    anything: dict[str, Any] = attrs.field(factory=dict)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("weights: 3", ":1: weights: 3; allowed: keys with values"),
        ("weights: [a]", "keys with values"),
        ("weights: {a: 1, b: c}", ":1: weights.b: 'c'; allowed: a number"),
        ("weights: {1: 2}", ":1: weights.1: 1; allowed: a text"),
    ],
)
def test_what_is_no_mapping_or_has_bad_values_is_refused(tmp_path, text, word):
    path = tmp_path / "mix.yaml"
    path.write_text(text)

    with pytest.raises(FileError, match=re.escape(word)):
        read_checked(path, Mix)


def test_where_anything_is_allowed_there_may_be_nothing(tmp_path):
    path = tmp_path / "mix.yaml"
    path.write_text("weights: {a: 1}\nanything: {b: }")

    assert read_checked(path, Mix) == Mix({"a": 1.0}, {"b": None})


def test_a_mistake_in_another_file_is_named_where_that_file_is_named(tmp_path):
    path = tmp_path / "mix.yaml"
    path.write_text("weights:\n  a: 1\n")

    with (
        pytest.raises(FileError, match=r"mix.yaml:2: weights.a: no such thing"),
        named_at(path, "weights", "a"),
    ):
        raise FileError("no such thing")
