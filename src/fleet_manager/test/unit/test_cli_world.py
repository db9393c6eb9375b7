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


def test_a_map_is_drawn(hive, tmp_path):
    code, out, _ = hive("world", "map", "lab", str(tmp_path / "lab"), "--format", "png")

    assert code == 0
    assert "400 x 240 cells of 0.05 m" in out
    assert (tmp_path / "lab.png").is_file()
    assert (tmp_path / "lab.yaml").is_file()
