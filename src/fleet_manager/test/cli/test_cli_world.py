# SPDX-License-Identifier: BSD-3-Clause
"""The commands `world check` and `world map`."""

import pytest

from fleet_manager.cli.main import run

BAD = "name: bad\nsize: [4.0, 4.0]\nwalls: []\nstarts:\n  - {name: a, pose: [9, 9, 0]}\n"


@pytest.fixture
def hive(capsys):
    def call(*words):
        code = run(None, words)
        said = capsys.readouterr()
        return code, said.out, said.err

    return call


def test_a_good_world_is_said_to_be_good(hive):
    code, out, _ = hive("world", "check", "lab")

    assert code == 0
    assert "lab: good. 'lab', 20 m x 12 m" in out


def test_mistakes_are_listed_with_their_lines(hive, tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(BAD)

    code, _, err = hive("world", "check", str(path))

    assert code == 2
    assert f"{path}:5: starts[0]:" in err
    assert "has 1 mistake" in err


@pytest.mark.parametrize("word", ["check", "map"])
def test_a_world_that_is_not_there_is_said_in_one_line(hive, word):
    code, _, err = hive("world", word, "nowhere")

    assert code == 2
    assert err.count("\n") == 1
    assert "not known" in err


WORLD = "name: {name}\nsize: {size}\nwalls: [{{name: a, box: [1, 1, 2, 2]}}]\nstarts: {starts}\n"


@pytest.mark.parametrize(
    ("changes", "words", "said"),
    [
        ({"size": "[400, 400]"}, (), "8000 x 8000 cells"),
        ({"starts": "[{name: s, pose: [1.5, 1.5, 0]}]"}, (), ":4: starts[0]: 's' at"),
        ({}, ("--resolution", "0"), "resolution 0.0 m; allowed: above 0"),
        ({}, ("--resolution", "50"), "at most 10"),
        ({"name": "../x"}, (), "'../x' is not a file name; give OUT as well"),
    ],
)
def test_a_map_that_cannot_be_drawn_says_why_in_one_line(hive, tmp_path, changes, words, said):
    path = tmp_path / "w.yaml"
    path.write_text(WORLD.format(**({"name": "w", "size": "[4, 4]", "starts": "[]"} | changes)))

    code, _, err = hive("world", "map", str(path), *words)

    assert code == 2
    assert err.count("\n") == 1
    assert said in err


def test_a_map_named_like_a_folder_is_refused_in_one_line(hive):
    code, _, err = hive("world", "map", "lab", ".")

    assert code == 2
    assert err.count("\n") == 1
    assert "'.' is a folder" in err


def test_a_map_is_drawn(hive, tmp_path):
    code, out, _ = hive("world", "map", "lab", str(tmp_path / "lab"), "--format", "png")

    assert code == 0
    assert "400 x 240 cells of 0.05 m" in out
    assert (tmp_path / "lab.png").is_file()
    assert (tmp_path / "lab.yaml").is_file()
