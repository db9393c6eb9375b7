# SPDX-License-Identifier: BSD-3-Clause
import pytest

from hive_common.map_file import load_map
from simenv.world.draw_map import main


def test_the_command_writes_a_map_that_can_be_loaded(tmp_path):
    assert main(["lab", str(tmp_path / "drawn"), "--resolution", "0.2"]) == 0

    grid = load_map(str(tmp_path / "drawn.yaml"))
    assert grid.cells.shape == (60, 100)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["moon", "map"], "draw_map: world 'moon': not known"),
        (["lab", "/nowhere/map"], "draw_map: /nowhere/map: cannot be written"),
        (["lab", "map", "--resolution", "0"], "draw_map: resolution 0.0 m"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(arguments, words, capsys):
    assert main(arguments) == 1

    said = capsys.readouterr().err
    assert said.startswith(words)
    assert said.count("\n") == 1
